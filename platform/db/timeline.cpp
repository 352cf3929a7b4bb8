#include "platform/db/timeline.h"

#include <algorithm>

namespace axlecast::db {

std::optional<std::size_t> ChooseServer(std::span<const ServerTimeline> servers, Timelines& seen) {
  for (const ServerTimeline& server : servers) {
    if (server.system.empty()) continue;
    std::int64_t& newest = seen[server.system];
    newest = std::max(newest, server.timeline);
  }
  for (std::size_t i = 0; i < servers.size(); ++i) {
    const ServerTimeline& server = servers[i];
    if (server.system.empty() || server.timeline == 0 || server.timeline == seen[server.system]) return i;
  }
  return std::nullopt;
}

std::string OldPrimaryText(const std::string& target, const ServerTimeline& server, const Timelines& seen) {
  const auto newest = seen.find(server.system);
  return "the database server " + target + " is an old primary: it writes timeline " +
         std::to_string(server.timeline) + ", and timeline " +
         std::to_string(newest == seen.end() ? 0 : newest->second) +
         " exists. It gets no data. Stop it, and make it a standby of the new primary (pg_rewind, or pg_basebackup "
         "into an empty directory).";
}

}  // namespace axlecast::db
