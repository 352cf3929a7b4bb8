#include "tools/axlecast/decode/can_notation.h"

#include <algorithm>
#include <charconv>
#include <cstddef>

#include "core/command/command_id.h"
#include "core/device/can.h"
#include "tools/axlecast/decode/line_text.h"

namespace axlecast {
namespace {

constexpr std::string_view kBlanks = " \t\r";
constexpr std::size_t kStandardDigits = 3;
constexpr std::size_t kExtendedDigits = 8;

struct Word {
  std::string_view text;
  std::size_t at = 0;  // in the line
};

// The next word from `from` on; an empty one at the end.
Word NextWord(std::string_view line, std::size_t from) {
  const std::size_t begin = std::min(line.find_first_not_of(kBlanks, from), line.size());
  const std::size_t end = std::min(line.find_first_of(kBlanks, begin), line.size());
  return {line.substr(begin, end - begin), begin};
}

bool IsHex(std::string_view text) {
  return !text.empty() && text.find_first_not_of("0123456789abcdefABCDEF") == std::string_view::npos;
}

HexLine Wrong(std::size_t index, std::string_view what) { return {{}, AtColumn(index, what)}; }

// The identifier with its flags: error frames have 8 digits too.
std::optional<std::uint32_t> ParseId(std::string_view digits) {
  std::uint32_t id = 0;
  if (!IsHex(digits) || digits.size() > kExtendedDigits) return std::nullopt;
  std::from_chars(digits.data(), digits.data() + digits.size(), id, 16);
  if (digits.size() == kStandardDigits) return id <= kCanStandardMask ? std::optional(id) : std::nullopt;
  if (digits.size() != kExtendedDigits) return std::nullopt;
  if ((id & kCanError) != 0) return (id & kCanExtendedMask) | kCanError;
  return id <= kCanExtendedMask ? std::optional(id | kCanExtended) : std::nullopt;
}

HexLine ToLine(std::uint32_t id, Bytes data) {
  const CanPacket packet = ToPacket({.id = id, .data = InlineBytes<kMaxCanData>(data)});
  const Bytes bytes = packet;
  return {{bytes.begin(), bytes.end()}, ""};
}

// `at`: where the data stand in the line.
HexLine WithData(std::uint32_t id, std::string_view data, std::size_t at) {
  const HexLine bytes = ParseHexLine(data);
  if (!bytes.problem.empty() || data.find('#') != std::string_view::npos)
    return Wrong(at, "the data is no pairs of hex digits");
  if (bytes.bytes.size() > kMaxCanData) {
    return Wrong(at, "a frame has at most 8 bytes of data, not " + std::to_string(bytes.bytes.size()));
  }
  return ToLine(id, bytes.bytes);
}

// ID#DATA
HexLine ParseCompact(const Word& word) {
  const std::size_t mark = word.text.find('#');
  const std::optional<std::uint32_t> id = ParseId(word.text.substr(0, mark));
  if (!id) return Wrong(word.at, "an identifier has 3 hex digits up to 7ff, or 8 up to 1fffffff");
  const std::string_view data = word.text.substr(mark + 1);
  const std::size_t at = word.at + mark + 1;
  if (data.starts_with('#')) return Wrong(at, "this is a CAN FD frame; the devices here have none");
  if (data.starts_with('R')) return ToLine(*id | kCanRemote, {});
  std::string digits(data);
  std::erase(digits, '.');  // cansend takes 11.22.33
  return WithData(*id, digits, at);
}

// ID [LENGTH] DATA
HexLine ParseColumns(const Word& id_word, const Word& length, std::string_view line) {
  const std::optional<std::uint32_t> id = ParseId(id_word.text);
  if (!id) return Wrong(id_word.at, "an identifier has 3 hex digits up to 7ff, or 8 up to 1fffffff");
  const std::size_t at = length.at + length.text.size();
  const std::string_view rest = line.substr(at);
  if (NextWord(rest, 0).text == "remote") return ToLine(*id | kCanRemote, {});
  // candump -a writes the data as text behind.
  HexLine parsed = WithData(*id, rest.substr(0, rest.find('\'')), at);
  const bool fits = parsed.bytes.size() == 4 + static_cast<std::size_t>(length.text[1] - '0');
  if (parsed.problem.empty() && !fits) return Wrong(length.at, "the frame has another length than this");
  return parsed;
}

bool IsLength(std::string_view text) {
  return text.size() == 3 && text[0] == '[' && text[1] >= '0' && text[1] <= '8' && text[2] == ']';
}

}  // namespace

std::optional<HexLine> ParseCanNotation(std::string_view text) {
  Word before;
  for (Word word = NextWord(text, 0); !word.text.empty(); word = NextWord(text, word.at + word.text.size())) {
    const std::size_t mark = word.text.find('#');
    if (mark == 0) return std::nullopt;  // a comment
    if (mark != std::string_view::npos) return ParseCompact(word);
    if (IsLength(word.text) && !before.text.empty()) return ParseColumns(before, word, text);
    before = word;
  }
  return std::nullopt;
}

}  // namespace axlecast
