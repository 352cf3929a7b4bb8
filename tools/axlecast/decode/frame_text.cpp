#include "tools/axlecast/decode/frame_text.h"

#include <algorithm>
#include <charconv>
#include <string>

#include "core/device/can.h"

namespace axlecast {
namespace {

constexpr std::string_view kGroupSeparators = " \t\r,:;-";
constexpr std::string_view kBlanks = " \t\r";
constexpr std::size_t kStandardDigits = 3;
constexpr std::size_t kExtendedDigits = 8;

bool Contains(std::string_view characters, char c) { return characters.find(c) != std::string_view::npos; }

std::string_view WithoutComment(std::string_view text) { return text.substr(0, text.find('#')); }

// "'G'", "byte 0x00" if it is not printable, or "the end".
std::string CharacterAt(std::string_view text, std::size_t index) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  if (index == text.size()) return "the end";
  if (text[index] >= ' ' && text[index] <= '~') return {'\'', text[index], '\''};
  const auto byte = static_cast<unsigned char>(text[index]);
  return {'b', 'y', 't', 'e', ' ', '0', 'x', kDigits[byte >> 4U], kDigits[byte & 0x0FU]};
}

tl::unexpected<Error> FailureAt(std::size_t index, const std::string& text) {
  return Failure("column " + std::to_string(index + 1) + ": " + text);
}

// Returns -1 if `c` is not a hex digit.
int Digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

bool IsHex(std::string_view text) {
  return !text.empty() && std::ranges::all_of(text, [](char c) { return Digit(c) >= 0; });
}

void Append(BitLine& line, bool bit) {
  const std::size_t place = line.bits++ % 8;
  if (place == 0) line.bytes.push_back(0);
  if (bit) line.bytes.back() |= static_cast<std::uint8_t>(0x80U >> place);
}

struct Word {
  std::string_view text;
  std::size_t at = 0;  // index in the line
};

// Returns the next word at or after `from`; an empty word at the end.
Word NextWord(std::string_view line, std::size_t from) {
  const std::size_t begin = std::min(line.find_first_not_of(kBlanks, from), line.size());
  const std::size_t end = std::min(line.find_first_of(kBlanks, begin), line.size());
  return {line.substr(begin, end - begin), begin};
}

// Returns the identifier with its flags. Error frames have 8 digits too.
Result<std::uint32_t> ParseIdentifier(const Word& word, std::string_view digits) {
  const auto wrong = [&word] {
    return FailureAt(word.at, "an identifier has 3 hex digits up to 7ff, or 8 up to 1fffffff");
  };
  std::uint32_t id = 0;
  if (!IsHex(digits) || digits.size() > kExtendedDigits) return wrong();
  std::from_chars(digits.data(), digits.data() + digits.size(), id, 16);
  if (digits.size() == kStandardDigits && id <= kCanStandardMask) return id;
  if (digits.size() != kExtendedDigits) return wrong();
  if ((id & kCanError) != 0) return (id & kCanExtendedMask) | kCanError;
  if (id > kCanExtendedMask) return wrong();
  return id | kCanExtended;
}

FrameBytes PacketOf(std::uint32_t id, Bytes data) {
  const CanPacket packet = ToPacket({.id = id, .data = InlineBytes<kMaxCanData>(data)});
  const Bytes bytes = packet;
  return {bytes.begin(), bytes.end()};
}

// `at`: index of the data in the line.
Result<FrameBytes> WithData(std::uint32_t id, std::string_view data, std::size_t at) {
  const auto bytes = ParseHexLine(data);
  if (!bytes || Contains(data, '#')) return FailureAt(at, "the data is not pairs of hex digits");
  if (bytes->size() > kMaxCanData) {
    return FailureAt(at, "a frame has at most 8 bytes of data, not " + std::to_string(bytes->size()));
  }
  return PacketOf(id, *bytes);
}

// ID#DATA
Result<FrameBytes> ParseCompact(const Word& word) {
  const std::size_t mark = word.text.find('#');
  const auto id = ParseIdentifier(word, word.text.substr(0, mark));
  if (!id) return Failure(id.error());
  const std::string_view data = word.text.substr(mark + 1);
  const std::size_t at = word.at + mark + 1;
  if (data.starts_with('#')) return FailureAt(at, "this is a CAN FD frame; the devices here use classic CAN");
  if (data.starts_with('R')) return PacketOf(*id | kCanRemote, {});
  std::string digits(data);
  std::erase(digits, '.');  // cansend accepts 11.22.33
  return WithData(*id, digits, at);
}

// ID [LENGTH] DATA
Result<FrameBytes> ParseColumns(const Word& id_word, const Word& length, std::string_view line) {
  const auto id = ParseIdentifier(id_word, id_word.text);
  if (!id) return Failure(id.error());
  const std::size_t at = length.at + length.text.size();
  const std::string_view rest = line.substr(at);
  if (NextWord(rest, 0).text == "remote") return PacketOf(*id | kCanRemote, {});
  // candump -a appends the data as text.
  Result<FrameBytes> packet = WithData(*id, rest.substr(0, rest.find('\'')), at);
  if (packet && packet->size() != 4 + static_cast<std::size_t>(length.text[1] - '0')) {
    return FailureAt(length.at, "the frame has another length");
  }
  return packet;
}

bool IsLength(std::string_view text) {
  return text.size() == 3 && text[0] == '[' && text[1] >= '0' && text[1] <= '8' && text[2] == ']';
}

}  // namespace

Result<FrameBytes> ParseHexLine(std::string_view text) {
  text = WithoutComment(text);
  FrameBytes bytes;
  bool in_run = false;  // the last character belongs to a byte
  for (std::size_t i = 0; i < text.size();) {
    if (Contains(kGroupSeparators, text[i])) {
      in_run = false;
      ++i;
      continue;
    }
    if (!in_run && text[i] == '0' && i + 1 < text.size() && (text[i + 1] == 'x' || text[i + 1] == 'X')) i += 2;
    in_run = true;
    if (i == text.size() || Digit(text[i]) < 0) {
      return FailureAt(i, CharacterAt(text, i) + " instead of a hex digit");
    }
    if (i + 1 == text.size() || Digit(text[i + 1]) < 0) {
      return FailureAt(i, CharacterAt(text, i) + " is alone: a byte has two hex digits");
    }
    bytes.push_back(static_cast<std::uint8_t>(Digit(text[i]) << 4 | Digit(text[i + 1])));
    i += 2;
  }
  return bytes;
}

Result<BitLine> ParseBitLine(std::string_view text) {
  text = WithoutComment(text);
  BitLine line;
  bool in_group = false;  // the last character was a digit
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '_' || Contains(kGroupSeparators, text[i])) {
      in_group = false;
      continue;
    }
    if (!in_group && text.substr(i, 2) == "0b") i += 2;
    if (i == text.size() || (text[i] != '0' && text[i] != '1')) {
      return FailureAt(i, CharacterAt(text, i) + " instead of 0 or 1");
    }
    in_group = true;
    Append(line, text[i] == '1');
  }
  return line;
}

std::optional<Result<FrameBytes>> ParseCanNotation(std::string_view text) {
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
