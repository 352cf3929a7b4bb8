#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>

namespace axlecast::db {

// The newest timeline that was seen of each cluster, by its system identifier. A promotion begins a new timeline. A server that accepts
// writes with an earlier one is an old primary that somebody has started again: what it gets is lost.
using Timelines = std::map<std::string, std::int64_t, std::less<>>;

// The history that a server writes.
struct ServerTimeline {
  std::string system;  // system identifier of the cluster: equal for a primary and its standbys; empty: unknown
  std::int64_t timeline = 0;  // 0: it is a standby
};

// The statement that returns both columns. Every user may run it.
inline constexpr const char* kTimelineQuery =
    "SELECT (SELECT system_identifier FROM pg_catalog.pg_control_system())::text, CASE WHEN "
    "pg_catalog.pg_is_in_recovery() THEN 0 ELSE ('x' || left(pg_catalog.pg_walfile_name("
    "pg_catalog.pg_current_wal_lsn()), 8))::bit(32)::int8 END";

// Returns the server to write to, of several that accept writes, in the order of the connection string: the first one whose cluster has no
// newer timeline among `servers` and in `seen`. Nothing if all are old primaries. Adds the timelines to `seen`.
[[nodiscard]] std::optional<std::size_t> ChooseServer(std::span<const ServerTimeline> servers, Timelines& seen);

// States that a server is an old primary, and what to do. `target`: its host, for example "db1:5432/axlecast".
[[nodiscard]] std::string OldPrimaryText(const std::string& target, const ServerTimeline& server,
                                         const Timelines& seen);

}  // namespace axlecast::db
