#include "client/axlecast/axis.h"

#include <axlecast/device_info_t.hpp>
#include <axlecast/position_t.hpp>
#include <cmath>
#include <utility>

#include "client/axis/connection.h"
#include "platform/os/process.h"

namespace axlecast {
inline namespace control {
namespace {

constexpr const char* kNoCommands = "this connection sends no commands: set ConnectionSettings::commands";

PositionTracker::Options TrackerOptions(const Axis::Options& options, const Connection::State& connection) {
  PositionTracker::Options tracker;
  tracker.max_age_ns = options.max_age_ns;
  tracker.max_extrapolation_ns = options.max_extrapolation_ns;
  tracker.max_gap_ns = options.max_gap_ns;
  tracker.machine_id = connection.machine_id;
  tracker.max_time_half_width_ns = options.max_time_half_width_ns;
  if (options.max_time_half_width_ns > 0) tracker.time = &connection.time;
  return tracker;
}

// Without the DEVICE message of this start of the driver, the unit of a position is not known.
void Explain(AxisPosition& position, const char* reason) {
  if (!position) {
    position.reason = reason;
  } else if (std::isnan(position.position.value)) {
    position.position = PositionTracker::Position();
    position.reason = "no DEVICE message of this start of the driver has arrived, which states the unit";
  }
}

CommandResult NotSent(const CommandId& id) {
  CommandResult result;
  result.id = id;
  result.not_accepted = true;
  result.problem = kNoCommands;
  return result;
}

}  // namespace

struct Axis::State final : Receiver {
  State(std::string name, const Options& options, const Connection::State& connection)
      : device(std::move(name)),
        position_channel("POSITION/" + device),
        device_channel("DEVICE/" + device),
        tracker(TrackerOptions(options, connection)) {}

  void On(const std::string& channel, Bytes message, std::int64_t now_ns) override {
    if (channel == position_channel) {
      if (const auto position = DecodeMessage<position_t>(message)) tracker.OnPosition(*position, now_ns);
    } else if (channel == device_channel) {
      if (const auto info = DecodeMessage<device_info_t>(message)) tracker.OnDevice(*info);
    }
  }

  // What every answer for the instant `mono_ns` contains. The connection is locked.
  [[nodiscard]] AxisPosition Answer(const PositionTracker::Position& position, std::int64_t mono_ns,
                                    std::int64_t now_ns) const {
    AxisPosition answer;
    answer.position = position;
    answer.freshness = tracker.Check(now_ns);
    answer.age_ns = tracker.AgeNs(now_ns);
    answer.newest = tracker.newest();
    answer.mono_ns = mono_ns;
    return answer;
  }

  const std::string device;
  const std::string position_channel;
  const std::string device_channel;
  PositionTracker tracker;
};

Axis::Axis(Connection& connection, std::string device, const Options& options)
    : connection_(connection.state_), state_(std::make_shared<State>(std::move(device), options, *connection_)) {
  connection_->Add(*state_);
}

Axis::~Axis() { connection_->Remove(*state_); }

AxisPosition Axis::Latest() const {
  const std::lock_guard lock(connection_->mutex);
  const PositionTracker& tracker = state_->tracker;
  const std::int64_t now = connection_->clock.Now();
  AxisPosition position = state_->Answer(tracker.Newest(now), tracker.NewestInstantNs(), now);
  Explain(position, ReasonText(position.freshness));
  position.base = connection_->time.OnBase(position.newest.clock_id, position.newest.mono_ns, now);
  if (position.base) position.base.half_width_ns += position.newest.time_uncertainty_ns;
  return position;
}

AxisPosition Axis::At(std::int64_t mono_ns) const {
  const std::lock_guard lock(connection_->mutex);
  const std::int64_t now = connection_->clock.Now();
  AxisPosition position = state_->Answer(state_->tracker.At(mono_ns), mono_ns, now);
  Explain(position, ReasonText(position.position.answer));
  position.base = connection_->time.OnBase(OwnClockId(), mono_ns, now);
  return position;
}

PositionTracker::Totals Axis::totals() const {
  const std::lock_guard lock(connection_->mutex);
  return state_->tracker.totals();
}

Result<> Axis::permits_state() const {
  if (!connection_->permits) return Failure("this connection issues no permits: set ConnectionSettings::permits");
  return connection_->permits->state();
}

// The issuer reads the time base: the receiving thread must not change it meanwhile.
bool Axis::Allow(const std::vector<std::string>& operations, std::int32_t valid_ms) {
  if (!connection_->permits) return false;
  const std::lock_guard lock(connection_->mutex);
  return connection_->permits->Allow(state_->device, operations, valid_ms);
}

bool Axis::Withdraw() {
  if (!connection_->permits) return false;
  const std::lock_guard lock(connection_->mutex);
  return connection_->permits->Withdraw(state_->device);
}

Result<> Axis::commands_state() const {
  if (!connection_->commands) return Failure(kNoCommands);
  return connection_->commands->state();
}

CommandId Axis::Send(CommandRequest request) {
  request.device = state_->device;
  return connection_->commands ? connection_->commands->Send(request) : RandomId();
}

CommandResult Axis::Await(const CommandId& id, std::int64_t timeout_ms) {
  return connection_->commands ? connection_->commands->Await(id, timeout_ms) : NotSent(id);
}

void Axis::Cancel(const CommandId& id) {
  if (connection_->commands) connection_->commands->Cancel(id);
}

CommandResult Axis::Query(const CommandId& id, std::int64_t timeout_ms) {
  return connection_->commands ? connection_->commands->Query(id, timeout_ms) : NotSent(id);
}

struct PositionSet::State final : Receiver {
  explicit State(const std::string& name) : set_channel("POSITION_SET/" + name) {}

  void On(const std::string& channel, Bytes message, std::int64_t now_ns) override {
    if (channel != set_channel) return;
    auto set = DecodeMessage<position_set_t>(message);
    if (!set || set->n < 0 || set->n > position_set_t::MAX_AXES) return;
    std::int64_t lost = 0;
    if (newest && set->boot_id == newest->set.boot_id) {
      if (set->seq <= newest->set.seq) return;
      lost = PositionTracker::LostBetween(newest->set.seq, set->seq);
    }
    newest = Reading{std::move(*set), now_ns, (newest ? newest->lost : 0) + lost};
  }

  const std::string set_channel;
  std::optional<Reading> newest;
};

PositionSet::PositionSet(Connection& connection, const std::string& name)
    : connection_(connection.state_), state_(std::make_shared<State>(name)) {
  connection_->Add(*state_);
}

PositionSet::~PositionSet() { connection_->Remove(*state_); }

std::optional<PositionSet::Reading> PositionSet::Newest() const {
  const std::lock_guard lock(connection_->mutex);
  return state_->newest;
}

}  // namespace control
}  // namespace axlecast
