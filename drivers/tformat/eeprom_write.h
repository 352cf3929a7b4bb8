#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/tformat/cell_reader.h"

namespace axlecast::tformat {

// Writes user EEPROM cells. All 80 cells are read first: servo motors may keep their name plate there. A cell that
// holds its value already is not written. Each other cell is written once (ID 6) and, after the 18 ms that this
// takes (TS5669 spec 8.1), read back with ID D. A busy or misunderstood request was not taken and is sent again;
// one whose reply is lost is judged by the read-back. A reply to ID 6 says that the write was accepted, not that it is
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
