#include <cstdint>
#include <string_view>

#include "tools/foxglove/foxglove_frames.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static_cast<void>(axlecast::ParseFoxgloveRequest({reinterpret_cast<const char*>(data), size}));
  return 0;
}
