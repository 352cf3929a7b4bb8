#include "tools/fleet/detail.h"

#include <utility>

namespace axlecast {

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

}  // namespace axlecast
