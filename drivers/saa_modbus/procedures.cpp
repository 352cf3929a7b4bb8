#include "drivers/saa_modbus/procedures.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <utility>

#include "core/device/operation.h"
#include "drivers/kit/command_runner.h"
#include "drivers/kit/read_back.h"

namespace axlecast::saa_modbus {
namespace {

using Reason = command_status_t;

Outcome LinkLost() {
  return Final(CommandState::kFailed, Reason::REASON_NO_REPLY, "the link was lost before the answer came");
}

std::optional<Outcome> OnFailure(const Answer& answer, int& failures) {
  if (++failures < kTries) return std::nullopt;
  return Final(CommandState::kFailed, Reason::REASON_NO_REPLY,
               Text("asked %d times in vain (%s)", failures, ErrorName(*answer.error)));
}

void AddPosition(Outcome& outcome, std::int64_t counts) {
  outcome.changes.push_back({"single_turn", "", std::to_string(counts)});
}

}  // namespace

Want Search::Next(MonoNs now) const {
  if (connection_.port_baud != place().baud) return PortBaud{place().baud};
  if (now < due_) return WaitUntil{due_};
  return ReadAt{place().address};
}

Search::Progress Search::OnAnswer(const Answer& answer) {
  if (answer.ok()) {
    counts_ = answer.reply.counts;
    return tried_ == 0 ? Progress::kFirst : Progress::kSecond;
  }
  if (++failures_ < kTries) return Progress::kGoing;
  failures_ = 0;
  if (tried_ + 1 == places_.size()) return Progress::kNowhere;
  ++tried_;
  return Progress::kGoing;
}

DatumWrite::DatumWrite(Parameter parameter, const SaaModbusSettings& settings, const Connection& connection,
                       const DeviceOutput& output)
    : parameter_(parameter), settings_(settings), connection_(connection), output_(output) {}

bool DatumWrite::AtRest(MonoNs now) const {
  const Motion motion = output_.MotionAt(now);
  return motion.known && motion.standstill;
}

bool DatumWrite::IsZero(std::int64_t counts) const {
  return CircularDistance(counts, 0, settings_.counts_per_turn) <= ZeroToleranceCounts(settings_.bits);
}

bool DatumWrite::SameBefore() const {
  return CannotBeToldApart(before_, 0, ZeroToleranceCounts(settings_.bits), settings_.counts_per_turn);
}

Want DatumWrite::Next(MonoNs now) const {
  if (now < due_) return WaitUntil{due_};
  if (stage_ == Stage::kSend && AtRest(now)) return Send{SetParameterRequest(connection_.address, parameter_)};
  return ReadAt{connection_.address};
}

std::optional<Outcome> DatumWrite::OnStarted(Bytes request, MonoNs now) {
  if (stage_ != Stage::kSend) return std::nullopt;
  const std::optional<Request> started = ParseRequest(request);
  if (started && started->writes()) {
    sent_ = true;
    return std::nullopt;
  }
  return NotAtRest(output_.MotionAt(now));
}

std::optional<Outcome> DatumWrite::OnAnswer(const Answer& answer, MonoNs end) {
  switch (stage_) {
    case Stage::kReadBefore:
      return OnBefore(answer);
    case Stage::kSend:
      accepted_ = answer.ok();
      stage_ = Stage::kReadAfter;
      failures_ = 0;
      return std::nullopt;
    default:
      return OnAfter(answer, end);
  }
}

std::optional<Outcome> DatumWrite::OnBefore(const Answer& answer) {
  if (!answer.ok()) {
    if (++failures_ < kTries) return std::nullopt;
    return Rejected(Reason::REASON_NO_REPLY,
                    Text("the reading before it failed %d times (%s)", failures_, ErrorName(*answer.error)));
  }
  before_ = answer.reply.counts;
  stage_ = Stage::kSend;
  Outcome running;
  running.text = "the position before it was read";
  running.progress = 0.3F;
  // If this process ends now, a later reading proves an effect only if the state before is known.
  return WithCounts(std::move(running), "");
}

std::optional<Outcome> DatumWrite::OnAfter(const Answer& answer, MonoNs end) {
  if (!answer.ok()) {
    if (++failures_ < kReadsAfter) return std::nullopt;
    return WithCounts(Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
                            Text("the request was sent%s, but the reading after it failed (%s): read_position when "
                                 "the encoder answers again",
                                 accepted_ ? " and echoed" : "", ErrorName(*answer.error))),
                      "");
  }
  const std::int64_t counts = answer.reply.counts;
  if (parameter_ != Parameter::kZero) return JudgeDirection(counts);
  if (!IsZero(counts) && ++looks_ < kLooks) {
    due_ = end + kReadAgain;
    return std::nullopt;
  }
  return JudgeZero(counts);
}

Outcome DatumWrite::JudgeZero(std::int64_t counts) const {
  const std::string text = "the position was " + PositionText(before_, settings_.bits) + " and is " +
                           PositionText(counts, settings_.bits);
  const std::string after = std::to_string(counts);
  if (!IsZero(counts)) {
    const char* echo = accepted_ ? "the encoder accepted it, but " : "the encoder's echo did not come, and ";
    return WithCounts(Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS, echo + text + ", not 0"),
                      after);
  }
  return WithCounts(JudgeReadBack({.same_before = SameBefore(), .confirmed = accepted_},
                                  text + (accepted_ ? "" : "; the echo did not come")),
                    after);
}

Outcome DatumWrite::JudgeDirection(std::int64_t counts) const {
  const std::string after = std::to_string(counts);
  if (!accepted_) {
    return WithCounts(Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
                            "the encoder's echo did not come: turn the shaft a little and see which way it counts"),
                      after);
  }
  return WithCounts(
      Succeeded(false,
                "the encoder accepted it; nothing can be read back at rest: turn the shaft a little and see "
                "which way it counts, then reference again"),
      after);
}

Outcome DatumWrite::OnLinkLost() const {
  if (sent_) {
    return WithCounts(Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
                            "the link was lost after the request and before its effect could be read: "
                            "read_position when it is back"),
                      "");
  }
  return Final(CommandState::kFailed, Reason::REASON_NO_REPLY, "nothing was done: the link was lost");
}

Outcome DatumWrite::WithCounts(Outcome outcome, const std::string& after) const {
  outcome.changes.push_back({"single_turn", std::to_string(before_), after});
  if (parameter_ != Parameter::kZero) return outcome;  // a direction cannot be found by looking
  return WithFindingBefore(std::move(outcome), SameBefore());
}

// ---- ReadPosition ----

std::optional<Outcome> ReadPosition::OnAnswer(const Answer& answer, MonoNs end) {
  if (!answer.ok()) return OnFailure(answer, failures_);
  Outcome outcome = Succeeded(true, PositionText(answer.reply.counts, settings_.bits));
  AddPosition(outcome, answer.reply.counts);
  if (after_) outcome.changes.push_back(FindingChange(Finding(answer.reply.counts, end)));
  return outcome;
}

// A shaft that turns may have left the place where it was zeroed; a direction does not show at rest.
const char* ReadPosition::Finding(std::int64_t counts, MonoNs now) const {
  if (after_ != Parameter::kZero) return kCannotTell;
  if (CircularDistance(counts, 0, settings_.counts_per_turn) <= ZeroToleranceCounts(settings_.bits))
    return kReadsAsAfter;
  const Motion motion = output_.MotionAt(now);
  return motion.known && motion.standstill ? kNoEffectSeen : kCannotTell;
}

Outcome ReadPosition::OnLinkLost() const { return LinkLost(); }

// ---- FindEncoder ----

FindEncoder::FindEncoder(Search::Place changed, std::string after, const SaaModbusSettings& settings,
                         Connection& connection)
    : changed_(changed),
      after_(std::move(after)),
      settings_(settings),
      connection_(connection),
      search_(changed, {connection.address, connection.baud}, connection) {}

std::optional<Outcome> FindEncoder::OnAnswer(const Answer& answer, MonoNs) {
  const Search::Progress progress = search_.OnAnswer(answer);
  if (progress == Search::Progress::kGoing) return std::nullopt;
  if (progress == Search::Progress::kNowhere) {
    return Final(CommandState::kFailed, Reason::REASON_NO_REPLY,
                 "the encoder answers neither where it was nor where " + after_ + " would have it");
  }
  const bool changed = progress == Search::Progress::kFirst;
  if (changed) {
    connection_.address = changed_.address;
    connection_.baud = changed_.baud;
  }
  Outcome outcome = Succeeded(true, Text("the encoder answers at address %d, %lld Bd: ", int{connection_.address},
                                         static_cast<long long>(connection_.baud)) +
                                        PositionText(search_.counts(), settings_.bits));
  AddPosition(outcome, search_.counts());
  outcome.changes.push_back({"address", "", std::to_string(connection_.address)});
  outcome.changes.push_back({"baud", "", std::to_string(connection_.baud)});
  outcome.changes.push_back(FindingChange(FindingWord(changed)));
  return outcome;
}

Outcome FindEncoder::OnLinkLost() const { return LinkLost(); }

// ---- AskAddress ----

std::optional<Outcome> AskAddress::OnAnswer(const Answer& answer, MonoNs) {
  if (!answer.ok()) return OnFailure(answer, failures_);
  const int address = answer.reply.address;
  Outcome outcome =
      address == connection_.address
          ? Succeeded(true, Text("the encoder has address %d", address))
          : Succeeded(true, Text("the encoder has address %d, but is asked at %d: change the file, or set_address "
                                 "address=%d from=%d",
                                 address, int{connection_.address}, int{connection_.address}, address));
  outcome.changes.push_back({"address", "", std::to_string(address)});
  return outcome;
}

Outcome AskAddress::OnLinkLost() const { return LinkLost(); }

}  // namespace axlecast::saa_modbus
