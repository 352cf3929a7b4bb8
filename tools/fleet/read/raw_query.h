#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "tools/fleet/read/fleet_reader.h"
#include "tools/fleet/read/position_query.h"
#include "tools/fleet/read/recorded_log.h"
#include "tools/fleet/rows.h"
#include "tools/log/log_event.h"

namespace axlecast {

// Returns which numbers of the log the database has as raw records.
[[nodiscard]] Result<RawCoverage> ReadCoverage(FleetReader& reader, const FleetLog& log);

// Returns the machine's file that the log has in its head; empty: it has none, or the head was damaged.
[[nodiscard]] Result<std::string> ReadMachineFile(FleetReader& reader, const FleetLog& log);

// The texts of the header events of a log that is written again.
struct FetchedHead {
  std::int64_t utime = 0;
  std::string recorder;  // JSON, as the recorder writes it
  std::string machine;
};
[[nodiscard]] FetchedHead HeadOf(const FleetLog& log, std::string machine_file);

// A row of raw records that is damaged.
struct DamagedRaw {
  std::string log;  // file name
  std::int64_t first_event = 0;
  std::int64_t n = 0;
  std::int64_t t0 = 0;
  std::int64_t t1 = 0;
  std::string why;
};

// The raw records of consecutive logs of one recorder, in the order of the events. Reads a few rows at a time.
class RawLane {
 public:
  // `logs`: in their order. `times`: of reception.
  RawLane(FleetReader& reader, std::vector<FleetLog> logs, QueryTimes times)
      : reader_(reader), logs_(std::move(logs)), times_(times) {}

  // Moves to the next event, or to the first one. Fails if the database cannot be read.
  [[nodiscard]] Result<> Advance();
  // Returns the event; null at the end. It is valid until the next call of Advance.
  [[nodiscard]] const LogEvent* head() const { return at_end_ ? nullptr : &event_; }
  [[nodiscard]] const std::vector<DamagedRaw>& damaged() const { return damaged_; }

 private:
  // Fetches the next rows. Leaves rows_ empty at the end.
  [[nodiscard]] Result<> Fetch();
  // Moves to the next event of the current row. Returns false at its end.
  bool NextRecord();

  FleetReader& reader_;
  std::vector<FleetLog> logs_;
  QueryTimes times_;
  std::size_t log_ = 0;
  std::int64_t after_ = -1;  // number of the first event of the last row
  std::deque<RawRow> rows_;  // that wait
  std::vector<std::uint8_t> records_;
  std::size_t offset_ = 0;
  LogEvent event_;
  bool at_end_ = true;
  std::vector<DamagedRaw> damaged_;
};

}  // namespace axlecast
