#include "drivers/kit/arguments.h"

#include <charconv>
#include <sstream>

namespace axlecast {

std::optional<std::string_view> FindArgument(const Arguments& arguments, std::string_view name) {
  for (const auto& [key, value] : arguments) {
    if (key == name) return value;
  }
  return std::nullopt;
}

std::optional<std::int64_t> ParseWhole(std::string_view text, std::int64_t min, std::int64_t max) {
  int base = 10;
  if (text.starts_with("0x")) {
    text.remove_prefix(2);
    base = 16;
  }
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  if (error != std::errc() || end != text.data() + text.size() || value < min || value > max) return std::nullopt;
  return value;
}

std::optional<std::vector<std::uint8_t>> ParseHex(std::string_view text) {
  std::vector<std::uint8_t> bytes;
  while (!text.empty()) {
    if (text.front() == ' ') {
      text.remove_prefix(1);
      continue;
    }
    std::uint8_t byte = 0;
    const std::string_view pair = text.substr(0, 2);
    const auto [end, error] = std::from_chars(pair.data(), pair.data() + pair.size(), byte, 16);
    if (error != std::errc() || end != pair.data() + 2) return std::nullopt;
    bytes.push_back(byte);
    text.remove_prefix(2);
  }
  if (bytes.empty()) return std::nullopt;
  return bytes;
}

std::optional<std::int64_t> WholeArgument(const Arguments& arguments, std::string_view name, std::int64_t min,
                                          std::int64_t max) {
  return ParseWhole(FindArgument(arguments, name).value_or(""), min, max);
}

std::optional<std::vector<std::uint8_t>> HexArgument(const Arguments& arguments, std::string_view name) {
  return ParseHex(FindArgument(arguments, name).value_or(""));
}

CommandLine ParseCommandLine(std::string_view text) {
  CommandLine line;
  std::istringstream words{std::string(text)};
  words >> line.operation;
  for (std::string word; words >> word;) {
    const std::size_t equals = word.find('=');
    if (equals != std::string::npos) {
      line.arguments.emplace_back(word.substr(0, equals), word.substr(equals + 1));
    } else if (!line.arguments.empty()) {
      line.arguments.back().second += ' ' + word;  // a value of several words: data=A1 05
    }
  }
  return line;
}

std::optional<CommandLine> AfterArgument(const Arguments& arguments) {
  const std::optional<std::string_view> after = FindArgument(arguments, "after");
  return after ? std::optional(ParseCommandLine(*after)) : std::nullopt;
}

}  // namespace axlecast
