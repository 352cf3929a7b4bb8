#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace axlecast {

// Byte limits of the strings in command messages, as lcmtypes/ documents them.
inline constexpr std::size_t kNameBytes = 24;
inline constexpr std::size_t kTextBytes = 200;
inline constexpr std::size_t kReasonBytes = 160;
inline constexpr std::size_t kArgumentBytes = 160;
inline constexpr std::size_t kChangeBytes = 80;
inline constexpr std::size_t kIdentityBytes = 64;
inline constexpr std::size_t kMaxChanges = 4;
inline constexpr std::size_t kMaxArguments = 16;

// The longest beginning of `text` within `bytes` that ends between two UTF-8 characters. Bytes that are no UTF-8
// and control characters become '?', so that the result can be shown and logged wherever it came from.
[[nodiscard]] std::string CappedText(std::string_view text, std::size_t bytes);

// The words with a blank between them; where they have not all room within `bytes`, those that have, then kAndMore.
inline constexpr std::string_view kAndMore = "*";
[[nodiscard]] std::string WordsWithin(std::span<const std::string> words, std::size_t bytes);

}  // namespace axlecast
