#pragma once

#include <yaml-cpp/yaml.h>

#include <cstdint>

namespace axlecast {

// Tells whether two runs had the same configuration of a device: FNV-1a, 64 bits, of the mapping's canonical text.
// Canonical: {"key":value,...} with the keys in byte order, [value,...], and every scalar as the file's characters
// in quotes, so comments, order and layout do not count, but 5 and 5.0 differ.
[[nodiscard]] std::int64_t ConfigHash(const YAML::Node& device);

}  // namespace axlecast
