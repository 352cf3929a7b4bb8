#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/axlecast/command.h"
#include "tools/axlecast/command/memory_cells.h"
#include "tools/axlecast/device_data/parameter_diff.h"

namespace axlecast {

// What `axlecast restore` does and has done (docs/backup.md). Pure.

// One thing in which the device differs from the backup.
struct RestoreLine {
  enum class State : std::uint8_t { kPending, kDone, kFailed, kImpossible };

  std::string what;  // "eeprom 10-12", or a parameter
  std::string before;
  std::string after;
  State state = State::kPending;
  std::string text;  // why it failed or is impossible
};

struct RestoreReport {
  std::string device;
  std::string file;
  std::string other_unit;          // why it is another unit than the one that was backed up; empty: it is not
  std::vector<RestoreLine> lines;  // what differs
  std::vector<std::string> kept;   // what the file holds and nobody can write back, with the reason
  bool compared = false;           // else it was refused before
  bool dry_run = false;
  std::optional<bool> reads_back;  // after writing: all that could be written reads as in the backup
};

[[nodiscard]] RestoreLine LineOf(const CellRun& run);
[[nodiscard]] RestoreLine LineOf(const ParameterChange& change);

// What a command made of the lines that it was about.
void Settle(RestoreLine& line, const CommandResult& result);

[[nodiscard]] std::string ToText(const RestoreReport& report);
[[nodiscard]] nlohmann::ordered_json ToJson(const RestoreReport& report);

}  // namespace axlecast
