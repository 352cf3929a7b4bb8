#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "platform/db/database.h"
#include "tools/fleet/read/fleet_reader.h"

namespace axlecast {

// Changes of the fleet database that a person makes. Each is one transaction, and fails without effect. The reader must be open.

// Renames a machine: its history keeps its id. Fails if `to` exists. Call it on the server that has the machine's data, and then, if it
// is another one, RenameShard on the one with the table of shards.
[[nodiscard]] Result<> RenameMachine(FleetReader& reader, const FleetMachine& machine, const std::string& to);
[[nodiscard]] Result<> RenameShard(FleetReader& reader, const std::string& from, const std::string& to);

// Accepts the machine from another installation of `axlecast ship`, and fences the shippers of the one before. `installation`: a UUID.
[[nodiscard]] Result<> AdoptMachine(FleetReader& reader, const FleetMachine& machine,
                                    const std::string& installation);
// Returns true for a UUID in lower or upper case, with its hyphens.
[[nodiscard]] bool IsUuid(const std::string& text);

// Sets or removes the place of a machine's data. Removing returns false if there was none.
[[nodiscard]] Result<> SetShard(FleetReader& reader, const std::string& machine, const std::string& connection);
[[nodiscard]] Result<bool> RemoveShard(FleetReader& reader, const std::string& machine);

struct RetentionRule {
  std::string kind;
  std::optional<std::int64_t> keep_us;  // nothing: without end
};
[[nodiscard]] Result<std::vector<RetentionRule>> ReadRetention(FleetReader& reader);
// Fails for a kind that the database does not have. At least one day.
[[nodiscard]] Result<> SetRetention(FleetReader& reader, const RetentionRule& rule);

// What a deletion by the rules of retention has removed.
struct Expired {
  std::string kind;
  std::int64_t partitions = 0;
  std::int64_t rows = 0;
};
[[nodiscard]] Result<std::vector<Expired>> Expire(FleetReader& reader);

}  // namespace axlecast
