#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "drivers/tformat/cell_reader.h"

namespace axlecast::tformat {

// Reads a row of user EEPROM cells and shows them.
class EepromRead final : public Procedure {
 public:
  // With `expected` it looks whether the cells hold these bytes (one for each): the change `finding` says.
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

}  // namespace axlecast::tformat
