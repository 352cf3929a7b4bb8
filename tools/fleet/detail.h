#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/base/time.h"
#include "core/config/ship_config.h"
#include "tools/log/channel_filter.h"

namespace axlecast {

// How much of a channel goes to the database, from nothing to everything.
enum class Detail : std::uint8_t {
  kNone,
  kRollup,    // positions: one row a second and one a minute; other channels: as kSamples
  kDeadband,  // positions: the samples that moved or changed a flag; other channels: as kSamples
  kSamples,   // positions: time, counts, flags and missed of every sample; other channels: their rows
  kFull,      // positions: every field of every sample; other channels: as kSamples
};

struct ChannelDetail {
  Detail detail = Detail::kSamples;
  double deadband = 0;            // kDeadband: in the device's unit
  MonoNs longest = 10 * kSecond;  // kDeadband: maximum time between two stored samples
  bool raw = false;               // the records of the channel are stored unchanged as well

  friend bool operator==(const ChannelDetail&, const ChannelDetail&) = default;
};

// Selects the detail of a channel: the first rule that matches. A channel without a match gets ChannelDetail() if the database
// has rows for its messages; else (WIRE too) nothing of it is stored.
class DetailRules {
 public:
  // Adds a rule behind the others. `channels`: a regular expression, as of ChannelFilter; channels are matched without the
  // machine's prefix. Returns an error if the expression is invalid.
  [[nodiscard]] Result<> Add(const std::string& channels, const ChannelDetail& detail);

  // Returns the detail of the first rule that matches, if there is one. `channel`: without the prefix.
  [[nodiscard]] std::optional<ChannelDetail> Match(std::string_view channel);

 private:
  struct Rule {
    ChannelFilter channels;
    ChannelDetail detail;
  };
  std::vector<Rule> rules_;
};

// Returns the rules of the machine's file. They were checked when the file was read.
[[nodiscard]] Result<DetailRules> DetailRulesOf(const ShipConfig& ship);

}  // namespace axlecast
