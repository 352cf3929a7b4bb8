#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "core/base/result.h"
#include "tools/fleet/read/fleet_reader.h"
#include "tools/fleet/read/position_query.h"

namespace axlecast {

// The options --from and --until, with the times of `axlecast log`: relative to the first and the last message of the machine that
// the database has.
class FleetTimeOptions {
 public:
  // The object must outlive the parsing.
  void AddTo(CLI::App& command);

  // Parses the options. Reads the machine's logs from the database if a time is relative.
  [[nodiscard]] Result<QueryTimes> Parse(FleetReader& reader, const FleetMachine& machine) const;

 private:
  std::string from_;
  std::string until_;
};

}  // namespace axlecast
