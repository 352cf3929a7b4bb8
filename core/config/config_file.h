#pragma once

#include <string>

#include "core/config/config_map.h"

namespace axlecast {

// Reads the machine's file into `text`. Returns false after an error: only a regular file is read that no other user may
// write, because who can write it decides who may command the machine. A file that is writable for the private group
// of its owner (Debian's user private groups, umask 002) is accepted. Never waits: a FIFO or a device is refused.
[[nodiscard]] bool ReadConfigFile(const std::string& file, std::string& text, ConfigErrors& errors);

// The same for a program that examines the file instead of obeying it: it may be one that others can write.
[[nodiscard]] bool ReadSharedConfigFile(const std::string& file, std::string& text, ConfigErrors& errors);

// Whether ReadConfigFile refuses the file because of those who can write it.
[[nodiscard]] bool OthersMayWriteConfig(const std::string& file);

}  // namespace axlecast
