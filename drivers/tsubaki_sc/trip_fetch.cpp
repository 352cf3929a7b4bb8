#include "drivers/tsubaki_sc/trip_fetch.h"

#include <axlecast/command_status_t.hpp>

#include "core/device/operation.h"
#include "drivers/tsubaki_sc/alarms.h"

namespace axlecast::tsubaki_sc {
namespace {

using Reason = command_status_t;

// Trips that come faster than a log can be read.
constexpr int kMaxRestarts = 5;

}  // namespace

// What the replies hold has gone to the reader already.
std::optional<Outcome> TripFetch::OnAnswer(const Answer& answer) {
  if (!begun_) return OnStatus(answer);
  if (!trips_.wanted()) return Done();
  if (!answer.ok()) {
    trips_.OnFailure(answer);
    // A quantity of a log that is refused is left out; without the status no log can be believed.
    if (answer.refused() && answer.block == kStatus) return GiveUp(ReasonOf(answer), CauseOf(answer));
    if (!answer.refused() && ++failures_ >= kTries) return GiveUp(Reason::REASON_NO_REPLY, CauseOf(answer));
    return std::nullopt;
  }
  failures_ = 0;
  if (trips_.restarts() > kMaxRestarts) {
    return GiveUp(Reason::REASON_BUSY, "the motor trips faster than its logs can be read");
  }
  return std::nullopt;
}

std::optional<Outcome> TripFetch::OnStatus(const Answer& answer) {
  if (!answer.ok()) {
    if (!answer.refused() && ++failures_ < kTries) return std::nullopt;
    return GiveUp(ReasonOf(answer), CauseOf(answer));
  }
  failures_ = 0;
  begun_ = true;
  trips_.WantAll();
  if (!trips_.wanted()) return Verified("no trip is recorded");
  return std::nullopt;
}

Outcome TripFetch::Done() const {
  const TripStatus& status = *trips_.status();
  Outcome outcome = Verified(Text("trip count %d; the logs are published as TRIP", status.count));
  for (std::size_t i = 0; i < kLogs; ++i) {
    if (status.factors[i] == 0) continue;
    outcome.changes.push_back({"log_" + std::to_string(i + 1), "", StatusText(status.factors[i])});
  }
  return outcome;
}

Outcome TripFetch::GiveUp(std::int32_t reason, const std::string& cause) const {
  return Final(CommandState::kFailed, reason, "not all logs could be read: " + cause);
}

}  // namespace axlecast::tsubaki_sc
