#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "drivers/tformat/procedure.h"
#include "drivers/tformat/settings.h"

namespace axlecast::tformat {

using EepromCells = std::array<std::uint8_t, kEepromCells>;

// Reads a row of user EEPROM cells with ID D, one by one. While the encoder writes it answers "busy", which is no
// data (TS5669 spec Table 4): asked again until it is over.
class CellReader {
 public:
  enum class Progress : std::uint8_t { kGoing, kDone, kFailed };

  CellReader(std::size_t first, std::size_t count, MonoNs timeout)
      : next_(first), end_(first + count), timeout_(timeout) {}

  [[nodiscard]] Step Next(MonoNs now) const;
  [[nodiscard]] Progress OnAnswer(const Answer& answer, MonoNs end, EepromCells& cells);
  [[nodiscard]] std::size_t next() const { return next_; }
  [[nodiscard]] std::string Failure() const;  // after kFailed

 private:
  std::size_t next_;
  std::size_t end_;
  MonoNs timeout_;
  MonoNs due_ = 0;
  int busy_ = 0;
  int failures_ = 0;
  const char* cause_ = "";
};

// A write takes 18 ms at most: how often and how many times to ask a busy encoder.
inline constexpr MonoNs kBusyPause = 2 * kMillisecond;
inline constexpr int kBusyTimes = 25;
// Exchanges of a procedure that may fail in a row.
inline constexpr int kTries = 3;

// Changes that show cells [first, first + count), 20 to a change: key eeprom_<first address>, "A1 05 ..." as value.
// `before` may be null.
[[nodiscard]] std::vector<Change> CellChanges(std::size_t first, std::size_t count, const EepromCells* before,
                                              const EepromCells& after);

}  // namespace axlecast::tformat
