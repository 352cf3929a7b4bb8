#pragma once

#include <nlohmann/json.hpp>

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "core/base/inline_bytes.h"
#include "core/config/machine_config.h"
#include "tools/mqtt/outbox.h"

namespace axlecast {

// How one of LCM's channels goes to the broker.
struct MqttTopic {
  std::string topic;
  std::string_view type;  // of the messages that belong there: "position_t"
  RetentionClass keeping = RetentionClass::kNewest;
  bool retain = false;
  PositionPace pace;  // shortest and longest distance of two messages
};

// Which topics there are: those of the devices and buses of the machine's file, of its bridge, and of a few recorders.
// Anybody may send on LCM, but names nothing here.
class TopicMap {
 public:
  explicit TopicMap(const MachineConfig& machine);

  // Nothing for channels that are not for the broker. COMMAND_STATUS is one topic for each device: CommandTopic.
  [[nodiscard]] std::optional<MqttTopic> Find(std::string_view channel);
  [[nodiscard]] std::optional<MqttTopic> CommandTopic(std::string_view device) const;
  [[nodiscard]] const std::string& status() const { return status_; }

 private:
  [[nodiscard]] bool IsRecorder(const std::string& name);

  std::string base_;  // "axlecast/press3/"
  std::string status_;
  std::map<std::string, PositionPace, std::less<>> devices_;
  std::set<std::string, std::less<>> buses_;
  std::set<std::string, std::less<>> recorders_;
  std::string own_;  // of ALARM: this program's
};

// The channel, below ALARM/, of the alarms of who carries the machine's messages to its broker.
[[nodiscard]] std::string MqttAlarmName(const MachineConfig& machine);

// Return the LCM channels on which TopicMap's messages come, as regular expressions: on the data port, on the command port.
[[nodiscard]] std::string MqttDataChannels();
inline constexpr const char* kMqttCommandChannels = "COMMAND_STATUS";

// The messages as brokers get them: every field under its name, words beside the numbers that are words, and without
// what is for LCM alone (spare, signatures) or nobody's business (tokens). docs/mqtt.md, docs/mqtt.schema.json.

// The message's JSON; nothing when it is none of this type.
[[nodiscard]] std::optional<nlohmann::ordered_json> MqttPayload(std::string_view type, Bytes message);

// The longest that is published, as text. What comes in one datagram of LCM is shorter.
inline constexpr std::size_t kLongestPayload = 16 << 10;

// JSON Schemas (draft 2020-12) of what is published, in "$defs" by the level of the topic behind the machine's: "position",
// "alarm", ... "status". Made from the messages' own (core/messages/json), so that they cannot drift.
[[nodiscard]] nlohmann::ordered_json MqttSchemas();

}  // namespace axlecast
