#include "tools/mqtt/sparkplug/host_state.h"

#include <limits>

#include "core/messages/json/field.h"

namespace axlecast {

std::optional<HostState> ParseHostState(std::string_view json) {
  const nlohmann::ordered_json state = ParseOutsideJson(json);
  if (!state.is_object()) return std::nullopt;
  const auto online = state.find("online");
  const auto timestamp = state.find("timestamp");
  if (online == state.end() || timestamp == state.end()) return std::nullopt;
  if (!online->is_boolean() || !timestamp->is_number_integer()) return std::nullopt;
  constexpr std::uint64_t kMax = std::numeric_limits<std::int64_t>::max();
  if (timestamp->is_number_unsigned() ? timestamp->get<std::uint64_t>() > kMax
                                      : timestamp->get<std::int64_t>() < 0) {
    return std::nullopt;
  }
  return HostState{online->get<bool>(), timestamp->get<std::int64_t>()};
}

bool PrimaryHost::On(const HostState& state) {
  if (newest_ms_ && state.timestamp_ms < *newest_ms_) return false;
  newest_ms_ = state.timestamp_ms;
  const bool changed = state.online != online_;
  online_ = state.online;
  return changed;
}

}  // namespace axlecast
