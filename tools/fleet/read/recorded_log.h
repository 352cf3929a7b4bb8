#pragma once

#include <cstdint>
#include <functional>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/inline_bytes.h"
#include "tools/log/log_event.h"

namespace axlecast {

// Writes a log again from its raw records, with the numbers that they had. The database does not store the header events and the
// seals of a log: the header is composed by the caller, and a seal is made wherever exactly one number is missing between two
// stretches, and at the end. If the header is the recorded one, all seals are equal to the recorded ones.
class RecordedLogEncoder {
 public:
  // Takes the next records. Returns false if they cannot be written.
  using Output = std::function<bool(Bytes)>;

  explicit RecordedLogEncoder(Output out) : out_(std::move(out)) {}

  // Writes a header event with the next number. Call it before the first Add.
  void AddHeader(std::int64_t utime, std::string_view channel, std::string_view text);
  // Writes the event with its number.
  void Add(const LogEvent& event);
  // Writes the last seal. Returns false if a write has failed.
  bool End();

  [[nodiscard]] bool good() const { return good_; }

 private:
  void Write(const LogEvent& event);

  Output out_;
  SealCount open_;
  std::int64_t next_ = 0;   // number after the last event
  std::int64_t utime_ = 0;  // of the last event
  bool good_ = true;
  std::vector<std::uint8_t> record_;
};

// Which numbers of a log its raw rows contain.
class RawCoverage {
 public:
  // Adds the next row, by first_event: the number of its first record, and how many records it has.
  void Add(std::int64_t first_event, std::int64_t n);

  // Returns true if the rows contain every message of the log up to `upto` (FleetLog): only the three header events and single seals
  // between rows are missing.
  [[nodiscard]] bool IsWhole(std::int64_t upto) const;
  [[nodiscard]] std::int64_t records() const { return records_; }

 private:
  static constexpr std::int64_t kHeaderEvents = 3;

  std::int64_t next_ = 0;
  std::int64_t records_ = 0;
  bool whole_ = true;
};

}  // namespace axlecast
