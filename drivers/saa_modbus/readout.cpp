#include "drivers/saa_modbus/readout.h"

#include <axlecast/command_status_t.hpp>
#include <utility>

#include "core/device/operation.h"
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
