#include "drivers/tformat/eeprom_read.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <utility>

#include "core/device/operation.h"
#include "drivers/kit/read_back.h"

namespace axlecast::tformat {

EepromRead::EepromRead(std::size_t first, std::size_t count, std::optional<std::vector<std::uint8_t>> expected,
                       MonoNs timeout)
    : first_(first), count_(count), expected_(std::move(expected)), reader_(first, count, timeout) {}

std::optional<Outcome> EepromRead::OnAnswer(const Answer& answer, MonoNs end) {
  switch (reader_.OnAnswer(answer, end, cells_)) {
    case CellReader::Progress::kGoing:
      return std::nullopt;
    case CellReader::Progress::kFailed:
      return Final(CommandState::kFailed, command_status_t::REASON_NO_REPLY, reader_.Failure());
    default:
      return Done();
  }
}

Outcome EepromRead::OnLinkLost() const {
  return Final(CommandState::kFailed, command_status_t::REASON_NO_REPLY,
               Text("the link was lost before EEPROM address %zu was read", reader_.next()));
}

Outcome EepromRead::Done() const {
  Outcome outcome = Verified(Text("EEPROM %zu to %zu read", first_, first_ + count_ - 1));
  outcome.changes = CellChanges(first_, count_, nullptr, cells_);
  if (expected_) {
    const bool equal = std::equal(expected_->begin(), expected_->end(), cells_.begin() + static_cast<int>(first_));
    constexpr std::size_t kRoomForCells = 3;  // an outcome holds four changes
    if (outcome.changes.size() > kRoomForCells) outcome.changes.resize(kRoomForCells);
    outcome.changes.push_back(FindingChange(FindingWord(equal)));
  }
  return outcome;
}

}  // namespace axlecast::tformat
