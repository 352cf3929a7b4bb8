#include "tools/fleet/ship/log_head.h"

#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "tools/log/log_event.h"

namespace axlecast {
namespace {

constexpr std::size_t kLongestName = 255;  // bytes, of names and hosts
constexpr int kHeadEvents = 8;             // more than a head has

std::optional<std::string> NameAt(const nlohmann::json& json, const char* key) {
  const auto found = json.find(key);
  if (found == json.end() || !found->is_string()) return std::nullopt;
  std::string text = found->get<std::string>();
  if (text.size() > kLongestName) return std::nullopt;
  return text;
}

std::optional<std::int64_t> NumberAt(const nlohmann::json& json, const char* key, std::int64_t max) {
  const auto found = json.find(key);
  if (found == json.end() || !found->is_number_integer()) return std::nullopt;
  const auto number = found->get<std::int64_t>();
  if (number < 0 || number > max) return std::nullopt;
  return number;
}

std::optional<LogKey> ParseKey(std::string_view text) {
  const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
  if (!json.is_object()) return std::nullopt;
  std::optional<std::string> name = NameAt(json, "name");
  std::optional<std::string> host = NameAt(json, "host");
  const auto start = NumberAt(json, "start_utime", std::numeric_limits<std::int64_t>::max());
  const auto number = NumberAt(json, "file_number", std::numeric_limits<std::int32_t>::max());
  if (!name || !host || !start || !number) return std::nullopt;
  return LogKey{*std::move(name), *std::move(host), *start, static_cast<std::int32_t>(*number)};
}

}  // namespace

Result<LogHead> ReadLogHead(Bytes log) {
  std::optional<LogKey> key;
  std::size_t offset = 0;
  for (int i = 0; i < kHeadEvents; ++i) {
    const std::optional<LogEvent> event = ParseEvent(log.subspan(offset));
    if (!event || !IsLogChannel(event->channel)) break;
    if (event->channel == kRecorderChannel && !key) {
      key = ParseKey(AsText(event->data));
      if (!key) return Failure("its head (AXLECAST/recorder) is damaged");
    }
    if (event->channel == kMachineChannel && key) {
      return LogHead{*std::move(key), std::string(AsText(event->data))};
    }
    offset += EventSize(*event);
  }
  if (key) return Failure("its head has no machine's file");
  return Failure("it does not begin with the head of a recorder of axlecast");
}

}  // namespace axlecast
