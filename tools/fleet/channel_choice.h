#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/config/machine_config.h"
#include "tools/fleet/detail.h"
#include "tools/log/channel_filter.h"

namespace axlecast {

// What the machine's file in the head of a log states about its devices and logs.
struct LogFacts {
  struct Device {
    std::int64_t counts_per_turn = 0;
    std::int8_t unit = 0;  // position_t UNIT_*
    double unit_per_count = 0;
    bool block = false;  // POSITION_BLOCK is published as well
  };

  std::string machine;
  std::string prefix;                                  // of every channel of the machine
  std::map<std::string, Device, std::less<>> devices;  // axes
  std::vector<LogConfig> logs;                         // of the recorder
};
[[nodiscard]] LogFacts LogFactsOf(const MachineConfig& machine);

// The messages that the database has rows for.
enum class ChannelKind : std::uint8_t {
  kOther,
  kPosition,
  kPositionBlock,
  kAlarm,
  kTrip,
  kDevice,
  kBus,
  kRecorder,
  kMotor,
  kTime,
  kCommandStatus,
  kCommand,
};

struct ChannelChoice {
  ChannelKind kind = ChannelKind::kOther;
  std::string name = {};                             // behind the slash: a device, a bus, a host
  ChannelDetail detail = {.detail = Detail::kNone};  // kNone: no rows
};

// Decides what of a channel one log contributes to the database:
// - A channel belongs to the first log of `recorder.logs` without a trigger whose filter matches. The other logs contribute
//   nothing of it.
// - The first rule that matches the channel without the machine's prefix decides its detail. Without a match, it is
//   ChannelDetail() if the database has rows for the channel, else kNone.
// - Of POSITION and POSITION_BLOCK of one device, one contributes rows: without `block: true` POSITION, else the one with more
//   detail; if equal, POSITION_BLOCK.
class ChannelChooser {
 public:
  // `log`: the name of the log within `recorder.logs`.
  ChannelChooser(const LogFacts& facts, std::string log, DetailRules detail);

  // `channel`: as in the log, with the prefix.
  [[nodiscard]] ChannelChoice Of(std::string_view channel);

 private:
  struct LogFilter {
    std::string name;
    ChannelFilter channels;
  };

  [[nodiscard]] const std::string* LogOf(std::string_view channel);
  [[nodiscard]] ChannelDetail DetailOf(std::string_view channel);
  [[nodiscard]] Detail ShippedDetail(const std::string& channel);
  [[nodiscard]] bool IsSource(ChannelKind kind, const std::string& device);

  std::string prefix_;
  std::map<std::string, bool, std::less<>> has_block_;  // axes
  std::string log_;
  DetailRules detail_;
  std::vector<LogFilter> filters_;  // of the logs without a trigger
};

}  // namespace axlecast
