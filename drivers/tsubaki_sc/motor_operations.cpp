#include <algorithm>
#include <axlecast/command_status_t.hpp>

#include "drivers/kit/arguments.h"
#include "drivers/kit/command_runner.h"
#include "drivers/tsubaki_sc/interpreter.h"
#include "drivers/tsubaki_sc/operations.h"
#include "drivers/tsubaki_sc/readout.h"

namespace axlecast::tsubaki_sc {
namespace {

using Reason = command_status_t;

constexpr std::string_view kClearTripCountName = "clear_trip_count";
constexpr std::string_view kReadStateName = "read_state";

// Registers of kStatus.
constexpr std::size_t kTripCount = 0;
constexpr std::size_t kMotorStatus = 1;

const char* BitText(bool on) { return on ? "1" : "0"; }

// stop_motor: sets coil 100 at once, then reads it. A stop whose reply is lost, that cannot be read back, or that reads
// 0 afterwards is sent again, for 5 s: stopping twice does no harm. It does not wait until an unclear line is cleared
// up; only its reading back does.
// Not an emergency stop: it takes a bus, a program and a unit that work.
class MotorStop final : public Procedure {
 public:
  explicit MotorStop(const Requests& requests) : requests_(requests) {}

  [[nodiscard]] Exchange Next() const override {
    return verifying_ ? requests_.Read(kStopCoil) : requests_.SetCoil(kStopCoilAddress);
  }
  void OnStarted() override { sent_ = sent_ || !verifying_; }
  void OnLoggedOut() override { sent_ = writes_ > 0; }
  std::optional<Outcome> OnAnswer(const Answer& answer) override {
    if (begun_at_ == kNever) begun_at_ = answer.end;
    return verifying_ ? OnCoil(answer) : OnWritten(answer);
  }
  std::optional<Outcome> OnFenceFailed(const Answer& answer) override {
    if (begun_at_ == kNever) begun_at_ = answer.end;
    return Repeat(answer);
  }
  [[nodiscard]] Outcome GiveUp(const Error& error) const override {
    if (!sent_) return Final(CommandState::kFailed, error.reason, "the stop was not sent: " + error.text);
    return Final(
        CommandState::kIndeterminate, error.reason,
        Text("the stop was sent %d times, but the stop coil could not be read: %s; stop the motor by other means",
             std::max(writes_, 1), error.text.c_str()));
  }
  [[nodiscard]] bool touched() const override { return sent_; }
  [[nodiscard]] bool unfenced() const override { return !verifying_; }
  [[nodiscard]] bool repeats() const override { return true; }

 private:
  static constexpr MonoNs kTime = 5 * kSecond;

  // After some stops without an answer, the coil is read all the same: one of them may have arrived.
  std::optional<Outcome> OnWritten(const Answer& answer) {
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

  std::optional<Outcome> OnCoil(const Answer& answer) {
    if (!answer.ok()) return Repeat(answer);
    if (answer.reply.Bit(0)) {
      Outcome outcome =
          Verified("the stop coil reads 1; whether the motor has stopped cannot be read, look at the power");
      outcome.changes = {{"stop_coil", "", "1"}};
      return outcome;
    }
    seen_off_ = true;
    return Repeat(answer);
  }

  // Sends it again, or ends if its time is over.
  std::optional<Outcome> Repeat(const Answer& answer) {
    verifying_ = false;
    unanswered_ = 0;
    if (!IsOver(answer.end)) return std::nullopt;
    if (seen_off_) {
      return Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS,
                   Text("the stop coil reads 0 after %d stops: stop the motor by other means", writes_));
    }
    Error error = ErrorOf(answer);
    const bool bytes = !answer.ok() && answer.error != ErrorKind::kTimeout && !answer.refused();
    if (bytes) error.text += " (bytes came that are no answer)";
    return GiveUp(error);
  }

  [[nodiscard]] bool IsOver(MonoNs now) const { return now - begun_at_ >= kTime; }

  const Requests& requests_;
  bool verifying_ = false;
  bool sent_ = false;
  MonoNs begun_at_ = kNever;  // about: the end of its first exchange
  int writes_ = 0;
  int unanswered_ = 0;     // in a row
  bool seen_off_ = false;  // the coil read 0 after the last stop that was answered
};

// clear_trip_count and start_motor: reads the status and the stop coil, sets its coil, and reads again. The coil goes
// off by itself (guideline 8), so only its effect can be read. It is written once: the reading shows the result.
class CoilCommand final : public Procedure {
 public:
  enum class Kind : std::uint8_t { kClearTripCount, kStartMotor };

  CoilCommand(Kind kind, const Requests& requests)
      : kind_(kind), requests_(requests), reader_(requests, {kStatus, kStopCoil}) {}

  [[nodiscard]] Exchange Next() const override {
    if (stage_ != Stage::kWrite) return reader_.Next();
    return requests_.SetCoil(kind_ == Kind::kStartMotor ? kStartCoil : kClearTripCountCoil);
  }
  void OnStarted() override { sent_ = sent_ || stage_ == Stage::kWrite; }
  void OnLoggedOut() override { sent_ = stage_ == Stage::kAfter; }
  std::optional<Outcome> OnAnswer(const Answer& answer) override {
    if (stage_ == Stage::kWrite) return OnWritten(answer);
    const Result<bool> done = reader_.OnAnswer(answer);
    if (!done) return GiveUp(done.error());
    if (!*done) return std::nullopt;
    if (stage_ == Stage::kBefore) return Before();
    return kind_ == Kind::kStartMotor ? Started() : Cleared();
  }
  [[nodiscard]] Outcome GiveUp(const Error& error) const override {
    if (!sent_) return Final(CommandState::kFailed, error.reason, "nothing was done: " + error.text);
    return Final(CommandState::kIndeterminate, error.reason,
                 "it was sent, but its effect could not be read: " + error.text);
  }
  [[nodiscard]] bool touched() const override { return sent_; }

 private:
  enum class Stage : std::uint8_t { kBefore, kWrite, kAfter };

  std::optional<Outcome> OnWritten(const Answer& answer) {
    if (answer.refused()) {
      sent_ = false;
      return Final(CommandState::kFailed, Reason::REASON_DEVICE_REFUSED, "the unit refused it: " + CauseOf(answer));
    }
    confirmed_ = answer.ok();
    stage_ = Stage::kAfter;
    reader_.Restart();
    return std::nullopt;
  }

  [[nodiscard]] Outcome Before() {
    stage_ = Stage::kWrite;
    count_before_ = reader_.Register(kStatus, kTripCount);
    stopped_before_ = reader_.Bit(kStopCoil);
    Outcome running;
    running.text = Text("trip count %u, stop coil %s", count_before_, BitText(stopped_before_));
    if (kind_ == Kind::kStartMotor) {
      const Result<> startable = CheckNotTripped(reader_.Register(kStatus, kMotorStatus));
      if (!startable) return RefusedOutcome(startable.error());
      running.changes = {{"stop_coil", BitText(stopped_before_), ""}};
    } else {
      if (count_before_ == 0) return Verified("the trip count is 0 already: nothing was sent");
      running.changes = {{"trip_count", std::to_string(count_before_), ""}};
    }
    return running;
  }

  [[nodiscard]] Outcome Cleared() const {
    const unsigned count = reader_.Register(kStatus, kTripCount);
    // It only rises by itself. So a lower one was cleared, and there was a trip since.
    Outcome outcome = count < count_before_
                          ? Verified(Text("the trip count was %u and reads %u", count_before_, count))
                          : Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS,
                                  Text("the trip count reads %u after the clear%s", count,
                                       confirmed_ ? "" : ", whose reply was lost; repeat it"));
    outcome.changes = {{"trip_count", std::to_string(count_before_), std::to_string(count)}};
    return outcome;
  }

  // No register shows whether the motor runs. Only the stop can be read: it is off (guideline 8), if it was on.
  [[nodiscard]] Outcome Started() const {
    const bool stopped = reader_.Bit(kStopCoil);
    const int status = reader_.Register(kStatus, kMotorStatus);
    Outcome outcome;
    if (stopped) {
      outcome = Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS,
                      Text("the stop coil still reads 1%s; motor status %s",
                           confirmed_ ? "" : ", the reply was lost", StatusText(status).c_str()));
    } else if ((status & kTripBits) != 0) {
      outcome =
          Final(CommandState::kFailed, Reason::REASON_DEVICE_ALARM, "the motor is tripped: " + StatusText(status));
    } else {
      outcome = ReadBackOutcome({.same_before = !stopped_before_, .confirmed = confirmed_},
                                "whether the motor turns cannot be read, look at the power; the stop coil reads 0");
    }
    outcome.changes = {{"stop_coil", BitText(stopped_before_), BitText(stopped)}};
    return outcome;
  }

  const Kind kind_;
  const Requests& requests_;
  BlockReader reader_;
  Stage stage_ = Stage::kBefore;
  bool sent_ = false;
  bool confirmed_ = false;  // the unit answered that it accepted the write
  unsigned count_before_ = 0;
  bool stopped_before_ = false;
};

// The change `finding` shows whether the operation `after` took effect: guideline 8. A trip, or somebody at the machine, may have
// undone it since.
Change StateFinding(std::string_view after, bool stopped, unsigned count) {
  if (after == kStopMotorName) return FindingChange(FindingWord(stopped, false));
  if (after == kStartMotorName) return FindingChange(FindingWord(!stopped, false));
  return FindingChange(FindingWord(count == 0, false));
}

Outcome ShowState(const BlockReader& read, std::string_view after) {
  const unsigned count = read.Register(kStatus, kTripCount);
  const std::string motor = StatusText(read.Register(kStatus, kMotorStatus));
  const bool stopped = read.Bit(kStopCoil);
  const bool logged_in = read.Register(kLoginStatus, 0) == kSaysLoggedIn;
  Outcome outcome =
      Verified(Text("trip count %u, motor status %s, stop coil %s, %s, mains %d Hz", count, motor.c_str(),
                    BitText(stopped), logged_in ? "logged in" : "logged out", read.Bit(kMains) ? 60 : 50));
  outcome.changes = {
      {"trip_count", "", std::to_string(count)},
      {"motor_status", "", motor},
      {"stop_coil", "", BitText(stopped)},
      after.empty() ? Change{"logged_in", "", BitText(logged_in)} : StateFinding(after, stopped, count)};
  return outcome;
}

MadeProcedure MakeReadState(const DriverCommand& command, const OperationContext& context) {
  std::string after;
  if (const auto text = FindArgument(command.arguments, "after")) {
    after = ParseCommandLine(*text).operation;
    if (after != kStopMotorName && after != kStartMotorName && after != kClearTripCountName) {
      return BadArgument("after must be stop_motor, start_motor or clear_trip_count");
    }
  }
  return std::make_unique<Readout>(context.requests, std::vector{kStatus, kStopCoil, kLoginStatus, kMains},
                                   [after](const BlockReader& read) { return ShowState(read, after); });
}

MadeProcedure MakeStop(const DriverCommand&, const OperationContext& context) {
  if (context.settings.motor_control != MotorControl::kNone) return std::make_unique<MotorStop>(context.requests);
  return NotPermitted("the configuration of this device has no motor_control: stop or start_stop");
}

MadeProcedure MakeStart(const DriverCommand&, const OperationContext& context) {
  if (context.settings.motor_control == MotorControl::kStartStop) {
    return std::make_unique<CoilCommand>(CoilCommand::Kind::kStartMotor, context.requests);
  }
  return NotPermitted("the configuration of this device has no motor_control: start_stop");
}

MadeProcedure MakeClear(const DriverCommand&, const OperationContext& context) {
  return std::make_unique<CoilCommand>(CoilCommand::Kind::kClearTripCount, context.requests);
}

}  // namespace

std::vector<Operation> MotorOperations() {
  return {
      {{.name = kStopMotorName,
        .help = "Stops the motor (coil 100), before everything else on the bus. Not an emergency stop",
        .verification = "coil 100 reads 1; whether the motor has stopped cannot be read",
        .verified_by_operation = kReadStateName,
        .urgent = true},
       MakeStop},
      {{.name = kStartMotorName,
        .help = "Starts the motor again (coil 200); not while it is tripped",
        .needs_permit = true,
        .verification = "coil 100 reads 0, if it read 1 before; whether the motor turns cannot be read",
        .verified_by_operation = kReadStateName},
       MakeStart},
      {{.name = kClearTripCountName,
        .help = "Sets the trip count to 0 (coil 0); trip factors and logs stay",
        .destructive = true,
        .verification = "the trip count reads 0",
        .verified_by_operation = kReadStateName},
       MakeClear},
      {ReadOnly({.name = kReadStateName,
                 .help = "Reads trip count, motor status, stop coil, login and mains frequency once",
                 .arguments = {kAfterArgument}}),
       MakeReadState},
  };
}

}  // namespace axlecast::tsubaki_sc
