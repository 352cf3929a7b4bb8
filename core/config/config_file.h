#pragma once

#include <cstdint>
#include <string>

#include "core/base/result.h"

namespace axlecast {

// Who may be able to write the machine's file.
enum class ConfigWriters : std::uint8_t {
  kOwner,   // who can write the file decides who may command the machine; for programs that obey it
  kAnyone,  // for programs that only examine it
};

// Reads the machine's file: a regular file without other writers. A file that is writable for the private group of its owner
// (Debian's user private groups, umask 002) is accepted. Never waits: a FIFO or a device is refused.
[[nodiscard]] Result<std::string> ReadConfigFile(const std::string& file,
                                                 ConfigWriters writers = ConfigWriters::kOwner);

// Returns true if others than its owner can write the file, so that ReadConfigFile refuses it.
[[nodiscard]] bool OthersMayWriteConfig(const std::string& file);

}  // namespace axlecast
