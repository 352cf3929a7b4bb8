#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/device/family.h"
#include "drivers/ssi/codec.h"
#include "drivers/ssi/settings.h"

namespace axlecast::ssi {

// What `--set` tells of a word.
struct DecodeOptions {
  Format format;
  std::vector<StatusBit> status_bits;
  std::optional<std::size_t> bit_count;  // of the frame; nothing: all bits of its bytes
};

// What is wrong with the settings; empty when nothing is.
[[nodiscard]] std::string ReadDecodeOptions(const DecodeSettings& settings, DecodeOptions& options);

}  // namespace axlecast::ssi
