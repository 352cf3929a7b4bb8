#include "drivers/tsubaki_sc/trips.h"

#include <axlecast/command_status_t.hpp>

#include "drivers/tsubaki_sc/interpreter.h"
#include "drivers/tsubaki_sc/operations.h"

namespace axlecast::tsubaki_sc {
int TripsBetween(const TripStatus& before, const TripStatus& after) {
  if (after.count > before.count) return after.count - before.count;
  if (after.count == before.count && after.factors == before.factors) return 0;
  return after.count;
}

namespace {

using Reason = command_status_t;

// Trips that come faster than a log can be read.
constexpr int kMaxRestarts = 5;

// fetch_trip_logs: reads the logs of the last three trips at once and publishes them. The reader has received every
// answer before the procedure does.
class TripFetch final : public Procedure {
 public:
  TripFetch(const Requests& requests, TripReader& trips) : requests_(requests), trips_(trips) {}

  // The unit's live slots read the logs too. When they have completed the last one, no log is left to request.
  [[nodiscard]] Exchange Next() const override {
    return requests_.Read(begun_ && trips_.pending() ? trips_.Next() : kStatus);
  }

  std::optional<Outcome> OnAnswer(const Answer& answer) override {
    if (!begun_) return OnStatus(answer);
    if (!trips_.pending()) return Done();
    if (!answer.ok()) {
      trips_.OnFailure(answer);
      // A quantity of a log that is refused is left out. Without the status no log is reliable.
      if (answer.refused() ? answer.block == kStatus : !MayRepeat(answer, failures_))
        return GiveUp(ErrorOf(answer));
      return std::nullopt;
    }
    failures_ = 0;
    if (trips_.restarts() > kMaxRestarts) {
      return GiveUp({"the motor trips faster than its logs can be read", Reason::REASON_BUSY});
    }
    return std::nullopt;
  }

  [[nodiscard]] Outcome GiveUp(const Error& error) const override {
    return Final(CommandState::kFailed, error.reason, "not all logs could be read: " + error.text);
  }

 private:
  std::optional<Outcome> OnStatus(const Answer& answer) {
    if (!answer.ok()) {
      if (MayRepeat(answer, failures_)) return std::nullopt;
      return GiveUp(ErrorOf(answer));
    }
    failures_ = 0;
    begun_ = true;
    trips_.RequestAll();
    if (!trips_.pending()) return Verified("no trip is recorded");
    return std::nullopt;
  }

  [[nodiscard]] Outcome Done() const {
    const TripStatus& status = *trips_.status();
    Outcome outcome = Verified(Text("trip count %d; the logs are published as TRIP", status.count));
    for (std::size_t i = 0; i < kLogs; ++i) {
      if (status.factors[i] == 0) continue;
      outcome.changes.push_back({"log_" + std::to_string(i + 1), "", StatusText(status.factors[i])});
    }
    return outcome;
  }

  const Requests& requests_;
  TripReader& trips_;
  bool begun_ = false;
  int failures_ = 0;
};

MadeProcedure MakeTripFetch(const DriverCommand&, const OperationContext& context) {
  return std::make_unique<TripFetch>(context.requests, context.trips);
}

}  // namespace

std::vector<Operation> TripOperations() {
  return {
      {{.name = "fetch_trip_logs",
        .help = "Reads the curves of the last three trips at once and publishes them; live data of the bus wait",
        .reads_only = true,
        .verification = "the trip count is the same before and after each log"},
       MakeTripFetch},
  };
}

}  // namespace axlecast::tsubaki_sc
