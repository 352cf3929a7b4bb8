#include "drivers/tsubaki_sc/motor.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>

#include "core/device/operation.h"
#include "drivers/kit/read_back.h"
#include "drivers/tsubaki_sc/interpreter.h"
#include "drivers/tsubaki_sc/operations.h"

namespace axlecast::tsubaki_sc {

using Reason = command_status_t;

Exchange MotorStop::Next() const {
  return verifying_ ? requests_.Read(kStopCoil) : requests_.SetCoil(kStopCoilAddress);
}

std::optional<Outcome> MotorStop::OnAnswer(const Answer& answer) {
  if (begun_at_ == kNever) begun_at_ = answer.end;
  return verifying_ ? OnCoil(answer) : OnWritten(answer);
}

// After some stops without an answer the coil is read all the same: one of them may have arrived.
std::optional<Outcome> MotorStop::OnWritten(const Answer& answer) {
  if (answer.refused()) {
    return Final(CommandState::kFailed, Reason::REASON_DEVICE_REFUSED,
                 "the unit refused the stop: " + CauseOf(answer) + "; stop the motor by other means");
  }
  ++writes_;
  seen_off_ = false;
  unanswered_ = answer.ok() ? 0 : unanswered_ + 1;
  verifying_ = unanswered_ == 0 || unanswered_ >= kTries;
  if (!IsOver(answer.end) || verifying_) return std::nullopt;
  return Repeat(answer);
}

std::optional<Outcome> MotorStop::OnCoil(const Answer& answer) {
  if (!answer.ok()) return Repeat(answer);
  if (answer.reply.Bit(0)) {
    Outcome outcome =
        Verified("the stop coil reads 1; whether the motor has stopped cannot be read, look at the power");
    outcome.changes.push_back({"stop_coil", "", "1"});
    return outcome;
  }
  seen_off_ = true;
  return Repeat(answer);
}

std::optional<Outcome> MotorStop::OnFenceFailed(const Answer& answer) {
  if (begun_at_ == kNever) begun_at_ = answer.end;
  return Repeat(answer);
}

std::optional<Outcome> MotorStop::Repeat(const Answer& answer) {
  verifying_ = false;
  unanswered_ = 0;
  if (!IsOver(answer.end)) return std::nullopt;
  if (seen_off_) {
    return Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS,
                 Text("the stop coil reads 0 after %d stops: stop the motor by other means", writes_));
  }
  const bool bytes = !answer.ok() && answer.error != ErrorKind::kTimeout && !answer.refused();
  return GiveUp(ReasonOf(answer), CauseOf(answer) + (bytes ? " (bytes came that are no answer)" : ""));
}

Outcome MotorStop::GiveUp(std::int32_t reason, const std::string& cause) const {
  if (!sent_) return Final(CommandState::kFailed, reason, "the stop was not sent: " + cause);
  return Final(
      CommandState::kIndeterminate, reason,
      Text("the stop was sent %d times, but the stop coil could not be read: %s; stop the motor by other means",
           std::max(writes_, 1), cause.c_str()));
}

CoilCommand::CoilCommand(Kind kind, const Requests& requests)
    : kind_(kind), requests_(requests), reader_(requests, {kStatus, kStopCoil}) {}

Exchange CoilCommand::Next() const {
  if (stage_ != Stage::kWrite) return reader_.Next();
  return requests_.SetCoil(kind_ == Kind::kStartMotor ? kStartCoil : kClearTripCountCoil);
}

std::optional<Outcome> CoilCommand::OnAnswer(const Answer& answer) {
  return stage_ == Stage::kWrite ? OnWritten(answer) : OnRead(answer);
}

std::optional<Outcome> CoilCommand::OnWritten(const Answer& answer) {
  if (answer.refused()) {
    sent_ = false;
    return Final(CommandState::kFailed, Reason::REASON_DEVICE_REFUSED, "the unit refused it: " + CauseOf(answer));
  }
  confirmed_ = answer.ok();
  stage_ = Stage::kAfter;
  reader_.Restart();
  return std::nullopt;
}

std::optional<Outcome> CoilCommand::OnRead(const Answer& answer) {
  switch (reader_.OnAnswer(answer)) {
    case BlockReader::Progress::kGoing:
      return std::nullopt;
    case BlockReader::Progress::kFailed:
      return GiveUp(reader_.reason(), reader_.cause());
    default:
      if (stage_ == Stage::kBefore) return Before();
      return kind_ == Kind::kStartMotor ? Started() : Cleared();
  }
}

Outcome CoilCommand::Before() {
  stage_ = Stage::kWrite;
  count_before_ = reader_.Register(kStatus, 0);
  stopped_before_ = reader_.Bit(kStopCoil);
  const int status = reader_.Register(kStatus, 1);
  if (kind_ == Kind::kStartMotor) {
    if (const Result<> startable = CheckNotTripped(status); !startable) return RefusedOutcome(startable.error());
  }
  if (kind_ == Kind::kClearTripCount && count_before_ == 0)
    return Verified("the trip count is 0 already: nothing was sent");
  Outcome running;
  running.text = Text("trip count %u, stop coil %d", count_before_, stopped_before_ ? 1 : 0);
  if (kind_ == Kind::kStartMotor)
    running.changes.push_back({"stop_coil", stopped_before_ ? "1" : "0", ""});
  else
    running.changes.push_back({"trip_count", std::to_string(count_before_), ""});
  return running;
}

Outcome CoilCommand::Cleared() const {
  const unsigned count = reader_.Register(kStatus, 0);
  // It only rises by itself, so a lower one was cleared, and there was a trip since.
  Outcome outcome = count < count_before_
                        ? Verified(Text("the trip count was %u and reads %u", count_before_, count))
                        : Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS,
                                Text("the trip count reads %u after the clear%s", count,
                                     confirmed_ ? "" : ", whose reply was lost; repeat it"));
  outcome.changes.push_back({"trip_count", std::to_string(count_before_), std::to_string(count)});
  return outcome;
}

// "Running" is not to be read anywhere. What can be seen is that the stop is off (guideline 8), if it was on.
Outcome CoilCommand::Started() const {
  const bool stopped = reader_.Bit(kStopCoil);
  const int status = reader_.Register(kStatus, 1);
  Outcome outcome;
  if (stopped) {
    outcome = Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS,
                    Text("the stop coil still reads 1%s; motor status %s", confirmed_ ? "" : ", the reply was lost",
                         StatusText(status).c_str()));
  } else if ((status & kTripBits) != 0) {
    outcome =
        Final(CommandState::kFailed, Reason::REASON_DEVICE_ALARM, "the motor is tripped: " + StatusText(status));
  } else {
    outcome = JudgeReadBack({.same_before = !stopped_before_, .confirmed = confirmed_},
                            "whether the motor turns cannot be read, look at the power; the stop coil reads 0");
  }
  outcome.changes.push_back({"stop_coil", stopped_before_ ? "1" : "0", stopped ? "1" : "0"});
  return outcome;
}

Outcome CoilCommand::GiveUp(std::int32_t reason, const std::string& cause) const {
  if (!sent_) return Final(CommandState::kFailed, reason, "nothing was done: " + cause);
  return Final(CommandState::kIndeterminate, reason,
               "it was sent, but what became of it could not be read: " + cause);
}

}  // namespace axlecast::tsubaki_sc
