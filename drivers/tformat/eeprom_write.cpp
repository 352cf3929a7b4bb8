#include "drivers/tformat/eeprom_write.h"

#include <axlecast/command_status_t.hpp>
#include <utility>

#include "drivers/runtime/device/outcome_text.h"
#include "drivers/tformat/reset_rules.h"

namespace axlecast::tformat {

using Reason = command_status_t;

EepromWrite::EepromWrite(std::size_t address, std::vector<std::uint8_t> data, MonoNs timeout)
    : address_(address), data_(std::move(data)), timeout_(timeout), reader_(0, kEepromCells, timeout) {}

Step EepromWrite::Next(MonoNs now) const {
  if (now < due_) return WaitUntil(due_);
  if (stage_ != Stage::kWrite) return reader_.Next(now);
  return CommandStep(WriteCell(static_cast<std::uint8_t>(cell()), data_[done_], timeout_));
}

std::optional<Outcome> EepromWrite::OnStarted(Bytes, MonoNs) {
  if (stage_ == Stage::kWrite) in_doubt_ = true;
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
    return Final(OrderState::kFailed, Reason::REASON_NO_REPLY,
                 "nothing was written: no backup first, " + reader_.Failure());
  }
  if (progress == CellReader::Progress::kGoing) return std::nullopt;
  now_ = backup_;
  return NextCell();
}

std::optional<Outcome> EepromWrite::OnWritten(const Answer& answer, MonoNs end) {
  const bool busy = answer.ok() && answer.reply.busy.value_or(false);
  if (busy || answer.not_taken) {
    in_doubt_ = false;
    due_ = busy ? end + kBusyPause : 0;
    ++(busy ? busy_ : misunderstood_);
    if (busy_ < kBusyTimes && misunderstood_ < kTries) return std::nullopt;
    return WithChanges(Final(OrderState::kFailed, Reason::REASON_DEVICE_REFUSED,
                             Text("the encoder did not take the write to EEPROM %zu (%s); ", cell(),
                                  busy ? "busy" : ErrorName(*answer.error)) +
                                 Written()));
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
  if (progress == CellReader::Progress::kFailed) {
    return WithChanges(Final(OrderState::kIndeterminate, Reason::REASON_NO_REPLY,
                             Text("EEPROM %zu was written, but not read back: ", cell()) + reader_.Failure()));
  }
  in_doubt_ = false;
  ++writes_;
  if (now_[cell()] != data_[done_]) {
    return WithChanges(
        Final(OrderState::kFailed, Reason::REASON_READ_BACK_DIFFERS,
              Text("EEPROM %zu reads %02X, not %02X%s; before it %s", cell(), unsigned{now_[cell()]},
                   unsigned{data_[done_]}, reply_lost_ ? ", the write's reply was lost" : "", Written().c_str())));
  }
  ++done_;
  return NextCell();
}

std::optional<Outcome> EepromWrite::NextCell() {
  while (done_ < data_.size() && now_[cell()] == data_[done_]) ++done_;
  if (done_ == data_.size()) {
    return WithChanges(Verified(Text("EEPROM %zu to %zu read back; ", address_, cell() - 1) + Written()));
  }
  stage_ = Stage::kWrite;
  busy_ = 0;
  misunderstood_ = 0;
  due_ = 0;
  Outcome running;
  running.text = Text("%zu of %zu cells hold their value", done_, data_.size());
  running.progress = static_cast<float>(done_) / static_cast<float>(data_.size());
  return running;
}

Outcome EepromWrite::OnLinkLost() const {
  if (in_doubt_) {
    return WithChanges(Final(OrderState::kIndeterminate, Reason::REASON_NO_REPLY,
                             Text("the link was lost before EEPROM %zu could be read back", cell())));
  }
  const Outcome outcome =
      Final(OrderState::kFailed, Reason::REASON_NO_REPLY, "the link was lost; before that " + Written());
  return stage_ == Stage::kBackup ? outcome : WithChanges(outcome);
}

std::string EepromWrite::Written() const { return Text("%d of %zu cells were written", writes_, data_.size()); }

// The backup and what the cells hold now, as far as it was read.
Outcome EepromWrite::WithChanges(Outcome outcome) const {
  outcome.changes = CellChanges(0, kEepromCells, &backup_, now_);
  return outcome;
}

}  // namespace axlecast::tformat
