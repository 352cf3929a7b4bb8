#include "tools/mqtt/sparkplug/birth_sequence.h"

#include <charconv>
#include <filesystem>
#include <system_error>

#include "platform/os/mapped_file.h"
#include "platform/os/new_file.h"
#include "tools/log/log_event.h"

namespace axlecast {
namespace {

constexpr std::string_view kWord = "bdSeq ";

}  // namespace

std::string FormatBirthSequence(std::uint8_t number) { return std::string(kWord) + std::to_string(number) + '\n'; }

std::optional<std::uint8_t> ParseBirthSequence(std::string_view text) {
  if (!text.starts_with(kWord) || !text.ends_with('\n')) return std::nullopt;
  text.remove_prefix(kWord.size());
  text.remove_suffix(1);
  std::uint8_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

std::uint8_t BirthSequence::Next() {
  problem_.clear();
  std::error_code error;
  if (!last_ && std::filesystem::exists(file_, error)) {
    const MappedFile file(file_);
    last_ = ParseBirthSequence(AsText(file.bytes()));
    if (!last_)
      problem_ = file_ + (file.problem().empty() ? " has no number: bdSeq begins at 0" : ": " + file.problem());
  }
  const auto number = static_cast<std::uint8_t>(last_ ? *last_ + 1 : 0);
  const Result<> written = WriteNewFile(file_, FormatBirthSequence(number), {.mode = 0600}, true);
  if (!written) problem_ = written.error().text;
  last_ = number;
  return number;
}

}  // namespace axlecast
