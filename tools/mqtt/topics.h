#pragma once

#include <nlohmann/json.hpp>

#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "core/base/inline_bytes.h"
#include "core/config/machine_config.h"
#include "tools/mqtt/outbox.h"

namespace axlecast {

// How the messages of one LCM channel are published.
struct MqttTopic {
  std::string topic;
  std::string_view type;  // of its messages: "position_t"
  RetentionClass keeping = RetentionClass::kNewest;
  bool retain = false;
  PositionPace pace;  // minimum and maximum interval of messages
};

// The topics of a machine: of the devices and buses in the machine file, of the bridge, and of a limited number of
// recorders. Messages of other names are not published, because anybody can send on LCM.
class TopicMap {
 public:
  explicit TopicMap(const MachineConfig& machine);

  // Returns nothing for channels that are not published. For COMMAND_STATUS, see CommandTopic.
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

// Returns the channel below ALARM/ for the alarms of axlecast mqtt.
[[nodiscard]] std::string MqttAlarmName(const MachineConfig& machine);

// Return the LCM channels on which TopicMap's messages come, as regular expressions: on the data port, on the command port.
[[nodiscard]] std::string MqttDataChannels();
inline constexpr const char* kMqttCommandChannels = "COMMAND_STATUS";

// The published messages: every field under its name, with names of enumerated values. Fields for LCM only (spare,
// signatures) and secrets (tokens) are removed. See docs/mqtt.md and docs/mqtt.schema.json.

// Returns the message as JSON; nothing if it has another type.
[[nodiscard]] std::optional<nlohmann::ordered_json> MqttPayload(std::string_view type, Bytes message);

// Maximum size of a published text. Every message in one LCM datagram is shorter.
inline constexpr std::size_t kLongestPayload = 16 << 10;

// JSON Schemas (draft 2020-12) of what is published, in "$defs" by the level of the topic behind the machine's: "position",
// "alarm", ... "status". Made from the messages' own (core/messages/json), so that they cannot drift.
[[nodiscard]] nlohmann::ordered_json MqttSchemas();

}  // namespace axlecast
