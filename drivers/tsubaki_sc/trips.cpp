#include "drivers/tsubaki_sc/trips.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <bit>

#include "drivers/tsubaki_sc/interpreter.h"
#include "drivers/tsubaki_sc/operations.h"

namespace axlecast::tsubaki_sc {
namespace {

using Reason = command_status_t;

// Trips that come faster than a log can be read.
constexpr int kMaxRestarts = 5;

}  // namespace

int TripsBetween(const TripStatus& before, const TripStatus& after) {
  if (after.count > before.count) return after.count - before.count;
  if (after.count == before.count && after.factors == before.factors) return 0;
  return after.count;
}

void TripReader::Forget() {
  status_.reset();
  logs_ = {};
  interval_us_ = 0;
  interval_unknown_ = false;
  BeginAgain();
}

void TripReader::BeginAgain() {
  begun_ = false;
  tried_ = 0;
  failures_ = 0;
}

std::size_t TripReader::Current() const {
  const auto found = std::find_if(logs_.begin(), logs_.end(), [](const Log& log) { return log.pending; });
  return static_cast<std::size_t>(found - logs_.begin());
}

Block TripReader::Next() const {
  if (interval_us_ == 0 && !interval_unknown_) return kLogInterval;
  if (tried_ == kAllQuantities) return kStatus;
  return LogBlock(Current(), static_cast<std::size_t>(std::countr_one(tried_)));
}

void TripReader::OnStatus(const TripStatus& status, Interval at) {
  if (!status_) {
    RequestHistory(status, at);
  } else if (const int trips = TripsBetween(*status_, status); trips > 0) {
    Shift(static_cast<std::size_t>(trips), status, at);
  } else if (Complete()) {
    Publish(status);
  }
  status_ = status;
  status_at_ = at;
}

// The trips that are recorded at the start happened before it. Factors and logs outlive a clear of the count.
void TripReader::RequestHistory(const TripStatus& status, Interval at) {
  for (std::size_t i = 0; i < kLogs; ++i) {
    const std::int32_t count = status.count - static_cast<std::int32_t>(i);
    logs_[i] = {.pending = status.factors[i] != 0,
                .fresh = false,
                .trip_count = std::max(count, 0),
                .not_before = 0,
                .not_after = at.last};
  }
}

void TripReader::Shift(std::size_t trips, const TripStatus& status, Interval at) {
  if (begun_) {
    ++restarts_;
    BeginAgain();
  }
  const std::size_t added = std::min(trips, kLogs);
  std::shift_right(logs_.begin(), logs_.end(), static_cast<std::ptrdiff_t>(added));
  for (std::size_t i = 0; i < added; ++i) {
    logs_[i] = {.pending = true,
                .fresh = true,
                .trip_count = status.count - static_cast<std::int32_t>(i),
                .not_before = status_at_.first,
                .not_after = at.last};
  }
}

void TripReader::RequestAll() {
  if (!status_) return;
  for (std::size_t i = 0; i < kLogs; ++i) {
    const bool recorded = status_->factors[i] != 0 || status_->count > static_cast<std::int32_t>(i);
    if (!recorded) continue;
    if (logs_[i].not_after == 0) {  // recorded before the count was cleared, or never seen
      logs_[i].trip_count = std::max(status_->count - static_cast<std::int32_t>(i), 0);
      logs_[i].not_after = status_at_.last;
    }
    logs_[i].pending = true;
    logs_[i].fresh = true;
  }
  BeginAgain();
  restarts_ = 0;
}

void TripReader::OnLogInterval(std::uint16_t tenths) {
  constexpr std::int32_t kTenth = 100'000;  // us
  constexpr std::uint16_t kLongest = 100;   // guideline 11: 1 to 100
  const bool possible = tenths >= 1 && tenths <= kLongest;
  interval_us_ = possible ? tenths * kTenth : 0;
  interval_unknown_ = !possible;
}

void TripReader::OnLog(const LogPlace& place, const modbus::Reply& reply, Interval at) {
  if (!pending() || place.log != Current()) return;
  if (!begun_) record_ = {.at = at};
  begun_ = true;
  record_.at.last = at.last;
  for (std::size_t i = 0; i < kLogSamples; ++i) {
    record_.samples[place.quantity][i] =
        static_cast<float>(ToUnits(kQuantityTable[place.quantity], reply.Register(i)));
  }
  const auto bit = static_cast<std::uint8_t>(1U << place.quantity);
  record_.valid_mask |= bit;
  tried_ |= bit;
  failures_ = 0;
}

void TripReader::OnFailure(const Answer& answer) {
  if (!answer.block) return;
  if (MayRepeat(answer, failures_)) return;
  failures_ = 0;
  if (*answer.block == kLogInterval) interval_unknown_ = true;
  const auto place = LogPlaceOf(*answer.block);
  if (!place || place->log != Current()) return;
  if (!begun_) record_ = {.at = answer.at};
  begun_ = true;
  tried_ |= static_cast<std::uint8_t>(1U << place->quantity);
}

void TripReader::Publish(const TripStatus& status) {
  const std::size_t index = Current();
  Log& log = logs_[index];
  record_.log_index = static_cast<std::int8_t>(index + 1);
  record_.trip_count = log.trip_count;
  record_.factor_bits = status.factors[index];
  record_.not_before = log.not_before;
  record_.not_after = log.not_after;
  record_.interval_us = interval_us_;
  for (std::size_t q = 0; q < kQuantities; ++q) {
    if ((record_.valid_mask >> q & 1U) == 0) record_.samples[q].fill(kUnknownQuantity);
  }
  log.pending = false;
  log.fresh = false;
  if (!pending()) restarts_ = 0;
  BeginAgain();
  if (record_.valid_mask != 0) output_.OnTrip(record_);
}

namespace {

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
