#include "drivers/tformat/cell_reader.h"

#include <algorithm>

#include "core/device/operation.h"

namespace axlecast::tformat {

Step CellReader::Next(MonoNs now) const {
  if (now < due_) return WaitUntil(due_);
  return CommandStep(AskCell(static_cast<std::uint8_t>(next_), timeout_));
}

CellReader::Progress CellReader::OnAnswer(const Answer& answer, MonoNs end, EepromCells& cells) {
  if (!answer.ok()) {
    cause_ = ErrorName(*answer.error);
    return ++failures_ < kTries ? Progress::kGoing : Progress::kFailed;
  }
  failures_ = 0;
  if (!answer.reply.data) {
    cause_ = "busy";
    due_ = end + kBusyPause;
    return ++busy_ < kBusyTimes ? Progress::kGoing : Progress::kFailed;
  }
  busy_ = 0;
  cells[next_++] = *answer.reply.data;
  return next_ < end_ ? Progress::kGoing : Progress::kDone;
}

std::string CellReader::Failure() const { return Text("EEPROM address %zu could not be read (%s)", next_, cause_); }

std::vector<Change> CellChanges(std::size_t first, std::size_t count, const EepromCells* before,
                                const EepromCells& after) {
  constexpr std::size_t kCellsPerChange = 20;
  std::vector<Change> changes;
  for (std::size_t at = first; at < first + count; at += kCellsPerChange) {
    const std::size_t length = std::min(kCellsPerChange, first + count - at);
    changes.push_back({"eeprom_" + std::to_string(at),
                       before == nullptr ? "" : HexText(Bytes(*before).subspan(at, length)),
                       HexText(Bytes(after).subspan(at, length))});
  }
  return changes;
}

}  // namespace axlecast::tformat
