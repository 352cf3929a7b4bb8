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
#include "tools/monitor/machine_view.h"

namespace axlecast {

// The commands in COMMAND_STATUS messages, each once by its id.
class CommandHistory {
 public:
  static constexpr std::size_t kMax = 256;
  static constexpr std::size_t kStates = 10;  // command_status_t STATE_*

  // Takes a status. Returns true if it is new. Answers about unknown ids are ignored.
  bool On(command_status_t status);

  // The newest kMax commands, in the order of their first status.
  [[nodiscard]] const std::deque<command_status_t>& newest() const { return newest_; }
  // Index in newest() of the command with the last status.
  [[nodiscard]] std::size_t last() const { return last_; }
  // Number of commands that ended in this state.
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
  bool listed = false;  // in the machine file
  std::optional<recorder_health_t> health;
  AlarmView alarms;
  MonoNs health_at = 0;

  // Returns recorder_health_t STATE_*; nothing if it is too old.
  [[nodiscard]] std::optional<std::int8_t> State(MonoNs now) const;
  // Returns true if it is silent because it has ended: its last message was that it was stopping.
  [[nodiscard]] bool Ended(MonoNs now) const;
};

// The complete state of a machine from its messages, live or from a log. Does no I/O. `now` is the time of reception; in a
// log, the time of the event. Its memory is bounded whatever is sent.
class Monitor {
 public:
  // The channels for OnMessage as LCM patterns, on the data port and on the command port.
  static constexpr const char* kDataChannels =
      "(POSITION|MOTOR|LIMITS|DEVICE|ALARM|BUS|BUS_TIMES|TRIP|RECORDER|TIME)/.*";
  static constexpr const char* kCommandChannels = "COMMAND_STATUS";
  static constexpr std::size_t kMaxRecorders = 16;             // in addition to those of the machine file
  static constexpr std::size_t kLargestMessage = kMaxMessage;  // bytes; axlecast sends no longer messages

  // Without a machine file, pass MachineConfig{}. All devices are then unlisted.
  explicit Monitor(const MachineConfig& machine);

  MonitorUpdate OnMessage(std::string_view channel, Bytes message, MonoNs now);
  // Updates the rates. Call it a few times per second.
  void Tick(MonoNs now) { machine_.Tick(now); }
  void OnReception(const ReceptionCounts& counts) { machine_.OnReception(counts); }

  [[nodiscard]] const MachineView& machine() const { return machine_; }
  [[nodiscard]] const std::vector<RecorderView>& recorders() const { return recorders_; }
  [[nodiscard]] const CommandHistory& commands() const { return commands_; }
  // Messages received and lost according to `seq`, by channel, for the parts that the views contain.
  [[nodiscard]] const std::map<std::string, SequenceCount, std::less<>>& channels() const { return channels_; }
  // Number of malformed messages, and of messages of no part of the machine.
  [[nodiscard]] std::int64_t passed_over() const { return passed_over_; }

 private:
  MonitorUpdate Take(std::string_view channel, Bytes message, MonoNs now);
  RecorderView* RecorderOf(std::string_view name);
  MonitorUpdate OnRecorder(std::string_view name, Bytes message, MonoNs now);
  MonitorUpdate OnRecorderAlarms(std::string_view name, Bytes message, MonoNs now);

  MachineView machine_;
  std::set<std::string, std::less<>> listed_recorders_;  // by the machine's file
  std::vector<RecorderView> recorders_;
  CommandHistory commands_;
  std::map<std::string, SequenceCount, std::less<>> channels_;
  std::int64_t passed_over_ = 0;
};

}  // namespace axlecast
