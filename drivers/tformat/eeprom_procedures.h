#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/tformat/operations.h"
#include "drivers/tformat/settings.h"

namespace axlecast::tformat {

using EepromCells = std::array<std::uint8_t, kEepromCells>;

// Reads a row of user EEPROM cells with ID D, one by one. While the encoder writes, it answers "busy" without
// data (TS5669 spec Table 4), and the cell is read again later.
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

// Reads a row of user EEPROM cells and shows them.
class EepromRead final : public Procedure {
 public:
  // With `expected`, the change `finding` reports whether the cells hold these bytes (one for each cell).
  EepromRead(std::size_t first, std::size_t count, std::optional<std::vector<std::uint8_t>> expected,
             MonoNs timeout);

  [[nodiscard]] Step Next(MonoNs now) const override { return reader_.Next(now); }
  std::optional<Outcome> OnStarted(Bytes, MonoNs) override { return std::nullopt; }
  std::optional<Outcome> OnAnswer(const Answer& answer, MonoNs end) override;
  [[nodiscard]] Outcome OnLinkLost() const override;

 private:
  [[nodiscard]] Outcome Done() const;

  std::size_t first_;
  std::size_t count_;
  std::optional<std::vector<std::uint8_t>> expected_;
  CellReader reader_;
  EepromCells cells_{};
};

// Writes user EEPROM cells. All 80 cells are read first: servo motors may keep their name plate there. A cell that
// holds its value already is not written. Each other cell is written once (ID 6) and, after the 18 ms that this
// takes (TS5669 spec 8.1), read back with ID D. A busy or misunderstood request was not taken and is sent again;
// one whose reply is lost is judged by the read-back. A reply to ID 6 proves that the write was accepted, not that it is
// done: what could not be read back is INDETERMINATE, and the outcome names the cells that were begun.
class EepromWrite final : public Procedure {
 public:
  EepromWrite(std::size_t address, std::vector<std::uint8_t> data, MonoNs timeout);

  [[nodiscard]] Step Next(MonoNs now) const override;
  std::optional<Outcome> OnStarted(Bytes request, MonoNs now) override;
  std::optional<Outcome> OnAnswer(const Answer& answer, MonoNs end) override;
  [[nodiscard]] Outcome OnLinkLost() const override;
  [[nodiscard]] bool touched() const override { return writes_ > 0 || in_doubt_; }

 private:
  enum class Stage : std::uint8_t { kBackup, kWrite, kReadBack };

  std::optional<Outcome> OnBackup(const Answer& answer, MonoNs end);
  std::optional<Outcome> OnWritten(const Answer& answer, MonoNs end);
  std::optional<Outcome> OnReadBack(const Answer& answer, MonoNs end);
  std::optional<Outcome> NextCell();
  void ReadBackAt(MonoNs due);
  [[nodiscard]] std::size_t cell() const { return address_ + done_; }
  [[nodiscard]] Outcome WithChanges(Outcome outcome) const;
  [[nodiscard]] Outcome NotReadBack() const;
  [[nodiscard]] std::string Cells() const;

  const std::size_t address_;
  const std::vector<std::uint8_t> data_;
  const MonoNs timeout_;
  Stage stage_ = Stage::kBackup;
  CellReader reader_;
  EepromCells backup_{};
  EepromCells now_{};
  std::size_t done_ = 0;   // cells that hold their value
  int writes_ = 0;         // cells written and read back
  bool begun_ = false;     // the present cell's write was sent, and not refused
  bool in_doubt_ = false;  // likewise, and not read back yet
  bool reply_lost_ = false;
  int busy_ = 0;           // times the present cell's write was not taken
  int misunderstood_ = 0;  // likewise
  MonoNs due_ = 0;
};

}  // namespace axlecast::tformat
