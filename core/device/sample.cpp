#include "core/device/sample.h"

#include <array>

namespace axlecast {

const char* ErrorName(ErrorKind kind) {
  static constexpr std::array<const char*, kErrorKinds> kNames = {"timeout",        "short",
                                                                  "framing",        "checksum",
                                                                  "wrong_echo",     "communication_alarm",
                                                                  "abnormal_reply", "wrong_identity",
                                                                  "range",          "implausible",
                                                                  "device",         "stray",
                                                                  "busy",           "io",
                                                                  "exception",      "silent"};
  return kNames.at(static_cast<std::size_t>(kind));
}

}  // namespace axlecast
