#include "tools/fleet/detail.h"

#include <utility>

namespace axlecast {
namespace {

Detail DetailOf(ShipLevel level) {
  switch (level) {
    case ShipLevel::kNone:
      return Detail::kNone;
    case ShipLevel::kRollup:
      return Detail::kRollup;
    case ShipLevel::kDeadband:
      return Detail::kDeadband;
    case ShipLevel::kSamples:
      return Detail::kSamples;
    case ShipLevel::kFull:
      return Detail::kFull;
  }
  return Detail::kSamples;
}

}  // namespace

Result<> DetailRules::Add(const std::string& channels, const ChannelDetail& detail) {
  Rule rule{.channels = {}, .detail = detail};
  if (auto set = rule.channels.Set(channels, false); !set) return set;
  rules_.push_back(std::move(rule));
  return {};
}

std::optional<ChannelDetail> DetailRules::Match(std::string_view channel) {
  for (Rule& rule : rules_) {
    if (rule.channels.Matches(channel)) return rule.detail;
  }
  return std::nullopt;
}

Result<DetailRules> DetailRulesOf(const ShipConfig& ship) {
  DetailRules rules;
  for (const ShipRule& rule : ship.rules) {
    const ChannelDetail detail{
        .detail = DetailOf(rule.detail), .deadband = rule.deadband, .longest = rule.longest, .raw = rule.raw};
    if (const Result<> added = rules.Add(rule.channels, detail); !added) return Failure(added.error());
  }
  return rules;
}

}  // namespace axlecast
