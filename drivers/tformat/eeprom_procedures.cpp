#include "drivers/tformat/eeprom_procedures.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <utility>

#include "core/device/operation.h"
#include "drivers/kit/read_back.h"
#include "drivers/tformat/reset_procedure.h"

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

using Reason = command_status_t;

EepromWrite::EepromWrite(std::size_t address, std::vector<std::uint8_t> data, MonoNs timeout)
    : address_(address), data_(std::move(data)), timeout_(timeout), reader_(0, kEepromCells, timeout) {}

Step EepromWrite::Next(MonoNs now) const {
  if (now < due_) return WaitUntil(due_);
  if (stage_ != Stage::kWrite) return reader_.Next(now);
  return CommandStep(WriteCell(static_cast<std::uint8_t>(cell()), data_[done_], timeout_));
}

std::optional<Outcome> EepromWrite::OnStarted(Bytes, MonoNs) {
  if (stage_ == Stage::kWrite) begun_ = in_doubt_ = true;
  return std::nullopt;
}

std::optional<Outcome> EepromWrite::OnAnswer(const Answer& answer, MonoNs end) {
  switch (stage_) {
    case Stage::kBackup:
      return OnBackup(answer, end);
    case Stage::kWrite:
      return OnWritten(answer, end);
    default:
      return OnReadBack(answer, end);
  }
}

std::optional<Outcome> EepromWrite::OnBackup(const Answer& answer, MonoNs end) {
  const CellReader::Progress progress = reader_.OnAnswer(answer, end, backup_);
  if (progress == CellReader::Progress::kFailed) {
    return Final(CommandState::kFailed, Reason::REASON_NO_REPLY,
                 "nothing was written: no backup first, " + reader_.Failure());
  }
  if (progress == CellReader::Progress::kGoing) return std::nullopt;
  now_ = backup_;
  return NextCell();
}

std::optional<Outcome> EepromWrite::OnWritten(const Answer& answer, MonoNs end) {
  const bool busy = answer.ok() && answer.reply.busy.value_or(false);
  if (busy || answer.not_taken) {
    begun_ = in_doubt_ = false;
    due_ = busy ? end + kBusyPause : 0;
    ++(busy ? busy_ : misunderstood_);
    if (busy_ < kBusyTimes && misunderstood_ < kTries) return std::nullopt;
    return WithChanges(Final(CommandState::kFailed, Reason::REASON_DEVICE_REFUSED,
                             Text("the encoder did not take the write to EEPROM %zu (%s): ", cell(),
                                  busy ? "busy" : ErrorName(*answer.error)) +
                                 Cells()));
  }
  reply_lost_ = !answer.ok();
  ReadBackAt(end + kWriteTime);
  return std::nullopt;
}

void EepromWrite::ReadBackAt(MonoNs due) {
  stage_ = Stage::kReadBack;
  reader_ = CellReader(cell(), 1, timeout_);
  due_ = due;
}

std::optional<Outcome> EepromWrite::OnReadBack(const Answer& answer, MonoNs end) {
  const CellReader::Progress progress = reader_.OnAnswer(answer, end, now_);
  if (progress == CellReader::Progress::kGoing) return std::nullopt;
  if (progress == CellReader::Progress::kFailed) return NotReadBack();
  in_doubt_ = false;
  ++writes_;
  if (now_[cell()] != data_[done_]) {
    return WithChanges(
        Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS,
              Text("EEPROM %zu reads %02X, not %02X%s: %s", cell(), unsigned{now_[cell()]}, unsigned{data_[done_]},
                   reply_lost_ ? ", the write's reply was lost" : "", Cells().c_str())));
  }
  ++done_;
  return NextCell();
}

std::optional<Outcome> EepromWrite::NextCell() {
  while (done_ < data_.size() && now_[cell()] == data_[done_]) ++done_;
  if (done_ == data_.size()) {
    const std::string cells = Text("EEPROM %zu to %zu ", address_, cell() - 1);
    if (writes_ == 0) return WithChanges(Verified(cells + "held these values already: nothing was written"));
    return WithChanges(Verified(cells + Text("read back; %d of %zu cells were written, the others held their value",
                                             writes_, data_.size())));
  }
  stage_ = Stage::kWrite;
  begun_ = false;
  busy_ = 0;
  misunderstood_ = 0;
  due_ = 0;
  Outcome running;
  running.text = Text("%zu of %zu cells hold their value", done_, data_.size());
  running.progress = static_cast<float>(done_) / static_cast<float>(data_.size());
  return WithChanges(std::move(running));
}

Outcome EepromWrite::NotReadBack() const {
  const char* known = reply_lost_ ? "was sent, its reply was lost" : "was accepted";
  return WithChanges(Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
                           Text("the write to EEPROM %zu %s, but is not known to be done: %s; %s", cell(), known,
                                reader_.Failure().c_str(), Cells().c_str())));
}

Outcome EepromWrite::OnLinkLost() const {
  if (in_doubt_) {
    return WithChanges(Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
                             Text("the link was lost before EEPROM %zu could be read back: ", cell()) + Cells()));
  }
  const Outcome outcome = Final(CommandState::kFailed, Reason::REASON_NO_REPLY, "the link was lost: " + Cells());
  return stage_ == Stage::kBackup ? outcome : WithChanges(outcome);
}

// "10 to 11 hold their value, 12 begun, 13 not begun"
std::string EepromWrite::Cells() const {
  std::string text;
  const auto add = [&](std::size_t first, std::size_t count, const char* what) {
    if (count == 0) return;
    text += text.empty() ? "" : ", ";
    text += count == 1 ? Text("%zu %s", first, what) : Text("%zu to %zu %s", first, first + count - 1, what);
  };
  const std::size_t begun = begun_ ? 1 : 0;
  add(address_, done_, done_ == 1 ? "holds its value" : "hold their value");
  add(cell(), begun, "begun");
  add(cell() + begun, data_.size() - done_ - begun, "not begun");
  return text;
}

// The backup and what the cells hold now, as far as it was read. While cells are in doubt: the rows that they are in, and
// what a look would have found before. A row has 20 cells, and an outcome holds four changes.
Outcome EepromWrite::WithChanges(Outcome outcome) const {
  constexpr std::size_t kRow = 20;
  constexpr std::size_t kRowsBesideTheFinding = 3;
  std::size_t first = 0;
  std::size_t rows = kEepromCells / kRow;
  if (outcome.state == CommandState::kRunning || outcome.state == CommandState::kIndeterminate) {
    first = address_ / kRow;
    rows = std::min((address_ + data_.size() - 1) / kRow + 1 - first, kRowsBesideTheFinding);
  }
  outcome.changes = CellChanges(first * kRow, rows * kRow, &backup_, now_);
  return WithFindingBefore(std::move(outcome), false);  // nothing is written that the cells hold already
}

}  // namespace axlecast::tformat
