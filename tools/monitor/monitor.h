#pragma once

#include <axlecast/command_status_t.hpp>
#include <axlecast/recorder_health_t.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "core/messages/message.h"
#include "core/messages/sequence_count.h"
#include "tools/monitor/device_view.h"
#include "tools/monitor/machine_view.h"

namespace axlecast {

// Commands as COMMAND_STATUS tells of them, each once, by its id.
class CommandHistory {
 public:
  static constexpr std::size_t kMax = 256;
  static constexpr std::size_t kStates = 10;  // command_status_t STATE_*

  // True when it told something new. Answers about unknown ids are passed over.
  bool On(command_status_t status);

  // The newest kMax, in the order in which they were first heard of.
  [[nodiscard]] const std::deque<command_status_t>& newest() const { return newest_; }
  // Where newest() holds the command that was heard of last.
  [[nodiscard]] std::size_t last() const { return last_; }
  // Commands whose one outcome was heard, by state.
  [[nodiscard]] std::int64_t outcomes(std::int8_t state) const {
    return outcomes_.at(static_cast<std::uint8_t>(state));
  }

 private:
  std::deque<command_status_t> newest_;
  std::size_t last_ = 0;
  std::array<std::int64_t, kStates> outcomes_{};
};

struct RecorderView {
  std::string name;
  bool listed = false;  // by the machine's file
  std::optional<recorder_health_t> health;
  AlarmView alarms;
  MonoNs health_at = 0;

  // recorder_health_t STATE_*; nothing when stale.
  [[nodiscard]] std::optional<std::int8_t> State(MonoNs now) const;
  // It is no longer heard because it has ended: the last that it published is that it was stopping.
  [[nodiscard]] bool Ended(MonoNs now) const;
};

// Everything that a machine's messages show, for those who show it on: from live LCM or from a log. Pure: fed with
// messages and instants; in a log, the events' own. What it holds is bounded whatever is sent.
class Monitor {
 public:
  // What OnMessage takes in, as a pattern of LCM: on the data port, and on the command port.
  static constexpr const char* kDataChannels =
      "(POSITION|MOTOR|LIMITS|DEVICE|ALARM|BUS|BUS_TIMES|TRIP|RECORDER)/.*";
  static constexpr const char* kCommandChannels = "COMMAND_STATUS";
  static constexpr std::size_t kMaxRecorders = 16;  // beside those of the machine's file, which always have room
  static constexpr std::size_t kLargestMessage = kMaxMessage;  // bytes; longer ones are nobody's of axlecast

  // Without a file (a log alone): MachineConfig{}; every device is then one that was only heard.
  explicit Monitor(const MachineConfig& machine);

  Heard OnMessage(std::string_view channel, Bytes message, MonoNs now);
  // At least a few times a second: closes the windows of the rates.
  void Tick(MonoNs now) { machine_.Tick(now); }
  void OnReception(const ReceptionCounts& counts) { machine_.OnReception(counts); }

  [[nodiscard]] const MachineView& machine() const { return machine_; }
  [[nodiscard]] const std::vector<RecorderView>& recorders() const { return recorders_; }
  [[nodiscard]] const CommandHistory& commands() const { return commands_; }
  // Messages received and lost by their `seq`, by channel; of what the views hold alone.
  [[nodiscard]] const std::map<std::string, SequenceCount, std::less<>>& channels() const { return channels_; }
  [[nodiscard]] std::int64_t passed_over() const { return passed_over_; }  // messages that told nothing

 private:
  Heard Take(std::string_view channel, Bytes message, MonoNs now);
  RecorderView* RecorderOf(std::string_view name);
  [[nodiscard]] bool HasRoomForRecorder(std::string_view name) const;
  Heard OnRecorder(std::string_view name, Bytes message, MonoNs now);
  Heard OnRecorderAlarms(std::string_view name, Bytes message, MonoNs now);

  MachineView machine_;
  std::set<std::string, std::less<>> listed_recorders_;  // by the machine's file
  std::vector<RecorderView> recorders_;
  CommandHistory commands_;
  std::map<std::string, SequenceCount, std::less<>> channels_;
  std::int64_t passed_over_ = 0;
};

}  // namespace axlecast
