#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tools/fleet/position_rows.h"
#include "tools/log/log_event.h"

namespace axlecast {

// Number and content of positions, minute by minute: two sets with equal digests are equal, apart from a chance of 2^-128. The order of
// the samples is of no importance, and the memory depends on the time only: 40 bytes a minute.
class PositionDigest {
 public:
  struct Minute {
    std::int64_t n = 0;
    std::uint64_t sums[2] = {};  // of two hashes of each sample
    bool operator==(const Minute&) const = default;
  };

  void Add(std::int64_t utime, std::int64_t counts, std::int32_t flags);

  [[nodiscard]] std::int64_t samples() const { return samples_; }
  [[nodiscard]] const std::map<std::int64_t, Minute>& minutes() const {
    return minutes_;
  }  // by their begin, us, UNIX time

 private:
  std::int64_t samples_ = 0;
  std::map<std::int64_t, Minute> minutes_;
};

// A minute in which two digests differ.
struct MinuteDifference {
  std::int64_t utime = 0;   // its begin
  std::int64_t in_log = 0;  // samples
  std::int64_t in_database = 0;
};
[[nodiscard]] std::vector<MinuteDifference> DifferencesOf(const PositionDigest& log,
                                                          const PositionDigest& database);

// The positions of one device, as POSITION and as POSITION_BLOCK: the database has one of the two.
struct DevicePositions {
  PositionDigest positions;
  PositionDigest blocks;
};

// A message that the database has in the table odd.
struct OddEvent {
  std::int64_t event = 0;    // its number in the log
  std::uint32_t crc32c = 0;  // of the message
};

// A hole of a log in the database.
struct LogGap {
  std::int64_t first_event = 0;  // number of the first event that is missing
  std::int64_t messages = 0;     // -1: unknown
  bool operator==(const LogGap&) const = default;
};

// What a log contains up to an event, calculated from the log alone, to be compared with the ledger.
class LogDigest {
 public:
  // `upto`: events with a number below count. `odd`: by number; their positions do not count.
  LogDigest(std::int64_t upto, std::string prefix, std::vector<OddEvent> odd)
      : upto_(upto), prefix_(std::move(prefix)), odd_(std::move(odd)) {}

  // Adds an event of the log; `end`: the offset behind its record.
  void Add(const LogEvent& event, std::size_t end);
  // Adds the whole log as the shipper reads it, from seal to seal. The events of a stretch for which the database has one of `gaps` (by
  // their numbers) do not count; what is readable of another damaged stretch counts, and the stretch is unexplained.
  void AddLog(Bytes log, const std::vector<LogGap>& gaps);

  [[nodiscard]] std::int64_t next() const { return next_; }            // number behind the last event that counts
  [[nodiscard]] std::int64_t events() const { return events_; }        // that count
  [[nodiscard]] std::int64_t remaining() const { return remaining_; }  // that do not count
  [[nodiscard]] std::size_t bytes() const { return bytes_; }    // of the log, up to the last event that counts
  [[nodiscard]] std::uint32_t chain() const { return chain_; }  // CRC-32C over the data of the seals
  [[nodiscard]] const std::map<std::string, DevicePositions>& devices() const { return devices_; }
  [[nodiscard]] std::int64_t gaps() const { return gaps_; }        // stretches that are holes in the database
  [[nodiscard]] std::int64_t missing() const { return missing_; }  // their messages, as far as known
  // Numbers of the first events of damaged stretches that the database does not have as holes.
  [[nodiscard]] const std::vector<std::int64_t>& unexplained() const { return unexplained_; }
  // Odd messages that the log has with other bytes, or not at all.
  [[nodiscard]] std::int64_t wrong_odd() const {
    return wrong_odd_ + static_cast<std::int64_t>(odd_.size() - next_odd_);
  }

 private:
  // Returns true if the database has the event in the table odd.
  bool TakeOdd(const LogEvent& event);

  void AddEvents(Bytes log, std::size_t begin, std::size_t end);

  std::int64_t upto_;
  std::string prefix_;
  std::vector<OddEvent> odd_;
  std::size_t next_odd_ = 0;
  std::int64_t wrong_odd_ = 0;
  std::int64_t next_ = 0;
  std::int64_t events_ = 0;
  std::int64_t remaining_ = 0;
  std::size_t bytes_ = 0;
  std::uint32_t chain_ = 0;
  std::int64_t gaps_ = 0;
  std::int64_t missing_ = 0;
  std::vector<std::int64_t> unexplained_;
  // By channel: the database does not store a message twice.
  std::map<std::string, SeqWindow, std::less<>> windows_;
  std::map<std::string, DevicePositions> devices_;
};

}  // namespace axlecast
