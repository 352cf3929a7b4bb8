#include "tools/foxglove/foxglove_frames.h"

#include <cstddef>
#include <limits>
#include <utility>

#include "core/messages/json/field.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

constexpr char kMessageData = 1;  // opcode of a binary frame from the server
constexpr std::size_t kLongestOperation = 64;

std::string Dumped(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

std::optional<std::uint32_t> NumberOf(const Json& json) {
  if (!json.is_number_unsigned()) return std::nullopt;
  const auto number = json.get<std::uint64_t>();
  if (number > std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
  return static_cast<std::uint32_t>(number);
}

std::optional<FoxgloveRequest> ParseSubscribe(const Json& list) {
  if (!list.is_array()) return std::nullopt;
  FoxgloveSubscribe request;
  for (const Json& one : list) {
    if (!one.is_object()) return std::nullopt;
    const std::optional<std::uint32_t> subscription = NumberOf(one.value("id", Json()));
    const std::optional<std::uint32_t> channel = NumberOf(one.value("channelId", Json()));
    if (!subscription || !channel) return std::nullopt;
    request.subscriptions.push_back({*subscription, *channel});
  }
  return request;
}

std::optional<FoxgloveRequest> ParseUnsubscribe(const Json& list) {
  if (!list.is_array()) return std::nullopt;
  FoxgloveUnsubscribe request;
  for (const Json& one : list) {
    const std::optional<std::uint32_t> subscription = NumberOf(one);
    if (!subscription) return std::nullopt;
    request.subscriptions.push_back(*subscription);
  }
  return request;
}

void AppendLittleEndian(std::string& text, std::uint64_t value, std::size_t size) {
  for (std::size_t i = 0; i < size; ++i) text += static_cast<char>(value >> (8 * i));
}

}  // namespace

std::string FoxgloveServerInfo(const std::string& name, const std::string& session_id) {
  return Dumped({{"op", "serverInfo"},
                 {"name", name},
                 {"capabilities", Json::array()},
                 {"supportedEncodings", Json::array()},
                 {"metadata", Json::object()},
                 {"sessionId", session_id}});
}

std::string FoxgloveAdvertise(const std::vector<const FoxgloveChannel*>& channels) {
  Json list = Json::array();
  for (const FoxgloveChannel* const channel : channels) {
    list.push_back({{"id", channel->id},
                    {"topic", channel->topic},
                    {"encoding", "cdr"},
                    {"schemaName", channel->schema_name},
                    {"schemaEncoding", "ros2msg"},
                    {"schema", channel->schema}});
  }
  return Dumped({{"op", "advertise"}, {"channels", std::move(list)}});
}

std::string FoxgloveUnadvertise(const std::vector<std::uint32_t>& ids) {
  return Dumped({{"op", "unadvertise"}, {"channelIds", ids}});
}

std::string FoxgloveStatus(FoxgloveLevel level, const std::string& message, const std::string& id) {
  return Dumped({{"op", "status"}, {"level", static_cast<int>(level)}, {"message", message}, {"id", id}});
}

std::string FoxgloveMessageHead(std::uint32_t subscription, std::uint64_t time_ns) {
  std::string head(1, kMessageData);
  AppendLittleEndian(head, subscription, 4);
  AppendLittleEndian(head, time_ns, 8);
  return head;
}

std::optional<FoxgloveRequest> ParseFoxgloveRequest(std::string_view text) {
  const Json json = ParseOutsideJson(text);
  if (!json.is_object() || !json.contains("op") || !json["op"].is_string()) return std::nullopt;
  const auto operation = json["op"].get<std::string>();
  if (operation == "subscribe") return ParseSubscribe(json.value("subscriptions", Json()));
  if (operation == "unsubscribe") return ParseUnsubscribe(json.value("subscriptionIds", Json()));
  return FoxgloveUnsupported{operation.substr(0, kLongestOperation)};
}

}  // namespace axlecast
