#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/axlecast/command.h"

namespace axlecast {

// The steps of an exchange, in their order.
enum class ReplaceStep : std::uint8_t { kBackup, kExchange, kAccept, kWriteBack, kDatum };
inline constexpr std::string_view kReplaceSteps[] = {"backup", "exchange", "accept", "write", "datum"};

// What `axlecast replace` did (docs/cli.md). Pure.
struct ReplaceReport {
  std::string device;
  bool has_position = true;    // false: a monitor, which has no datum
  std::string backup;          // its file; empty: none
  std::string backup_problem;  // why there is none
  std::string encoder;         // what answers after the exchange; empty: not looked at
  std::optional<CommandResult> accepted;
  std::vector<CommandResult> written;      // write backs, in their order
  std::vector<std::size_t> not_permitted;  // addresses that differ from the backup, and that the file does not list
  std::optional<CommandResult> datum;
  std::optional<ReplaceStep> stopped;  // at this step; nothing: it went through
};

[[nodiscard]] nlohmann::ordered_json ToJson(const ReplaceReport& report);
[[nodiscard]] std::string ToText(const ReplaceReport& report);

// The command that goes on where it stopped; without a stop the one that sets the datum later, or nothing.
[[nodiscard]] std::string NextCommand(const ReplaceReport& report);

}  // namespace axlecast
