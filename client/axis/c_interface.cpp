#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <limits>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/axlecast/axis.h"
#include "client/axlecast/axlecast.h"

// NOLINTBEGIN(readability-identifier-naming): names of C
struct ax_connection {
  explicit ax_connection(const axlecast::ConnectionSettings& settings) : connection(settings) {}
  axlecast::Connection connection;
};

struct ax_axis {
  ax_axis(axlecast::Connection& connection, const char* device, const axlecast::Axis::Options& options)
      : axis(connection, device, options) {}
  axlecast::Axis axis;
};

struct ax_set {
  ax_set(axlecast::Connection& connection, const char* name) : set(connection, name) {}
  axlecast::PositionSet set;
};
// NOLINTEND(readability-identifier-naming)

namespace {

using axlecast::Axis;
using axlecast::AxisPosition;
using axlecast::CommandId;
using axlecast::CommandOutcome;
using axlecast::CommandResult;
using Freshness = axlecast::PositionTracker::Freshness;

constexpr std::size_t kMaxName = 64;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::string Text(const char* text) { return text == nullptr ? std::string() : std::string(text); }

template <std::size_t kSize>
void Copy(std::string_view text, char (&to)[kSize]) {
  const std::size_t size = std::min(text.size(), kSize - 1);
  std::fill(std::copy_n(text.begin(), size, std::begin(to)), std::end(to), '\0');
}

ax_code Report(ax_error* error, ax_code code, std::string_view text) {
  if (error != nullptr) {
    error->code = code;
    Copy(text, error->text);
  }
  return code;
}

bool IsName(const char* name) {
  if (name == nullptr || *name == '\0' || std::strlen(name) > kMaxName) return false;
  return std::strchr(name, '/') == nullptr;
}

// Runs `work`, so that no exception leaves the interface: only memory can run out.
template <typename Work>
ax_code Guarded(Work work) {
  try {
    return work();
  } catch (...) {
    return AX_MEMORY;
  }
}

// Makes a handle, or returns null with the error.
template <typename Handle, typename Make>
Handle* Opened(ax_error* error, Make make) {
  try {
    std::unique_ptr<Handle> handle = make();
    if (handle != nullptr) Report(error, AX_OK, "");
    return handle.release();
  } catch (...) {
    Report(error, AX_MEMORY, ax_code_text(AX_MEMORY));
    return nullptr;
  }
}

ax_instant ToC(const axlecast::TimeBase::Instant& instant) {
  if (!instant) return {0, 0, -1, ReasonText(instant.answer)};
  return {instant.base_id, instant.ns, instant.half_width_ns, ""};
}

ax_code Fill(const AxisPosition& from, ax_position& to) {
  const bool known = static_cast<bool>(from);
  const bool speed = known && (from.newest.flags & axlecast::position_t::FLAG_SPEED_VALID) != 0;
  to.value = from.position.value;
  to.counts = from.position.counts;
  to.timing_error_counts = from.position.timing_error_counts;
  to.speed_rad_s = speed ? from.newest.speed_rad_s : kNan;
  to.mono_ns = from.mono_ns;
  to.age_ns = from.age_ns;
  to.base = ToC(from.base);
  to.unit = std::int32_t{from.newest.unit};
  to.flags = from.position.flags;
  to.datum_epoch = from.position.datum_epoch;
  to.freshness = static_cast<ax_freshness>(from.freshness);
  to.reason = from.reason;
  return known ? AX_OK : AX_NO_POSITION;
}

ax_code Fill(const CommandResult& from, ax_result& to) {
  to.outcome = static_cast<ax_outcome>(from.outcome());
  to.under_way = from.under_way ? 1 : 0;
  to.temporary = from.temporary() ? 1 : 0;
  to.progress = from.status.progress;
  to.epoch_after = from.answered ? from.status.epoch_after : -1;
  Copy(from.answered ? from.reason() : std::string_view(), to.reason);
  Copy(from.problem.empty() ? from.status.text : from.problem, to.text);
  return from.under_way ? AX_NOT_YET : AX_OK;
}

CommandId FromC(const ax_id& id) {
  CommandId made;
  std::copy(std::begin(id.bytes), std::end(id.bytes), made.begin());
  return made;
}

void Fill(const axlecast::position_set_axis_t& from, std::int64_t tick_ns, ax_set_axis& to) {
  Copy(from.device, to.device);
  to.state = static_cast<ax_set_axis_state>(from.state);
  to.at_ns = tick_ns + from.offset_ns;
  to.half_width_ns = from.half_width_ns;
  to.counts = from.counts;
  to.value = from.value;
  to.speed_rad_s = from.speed_rad_s;
  to.unit = std::int32_t{from.unit};
  to.flags = from.flags;
  to.datum_epoch = from.datum_epoch;
}

constexpr bool SameOrder() {
  return static_cast<int>(Freshness::kFresh) == AX_FRESH && static_cast<int>(Freshness::kStale) == AX_STALE &&
         static_cast<int>(Freshness::kNotValid) == AX_NOT_VALID &&
         static_cast<int>(Freshness::kNoReading) == AX_NO_READING &&
         static_cast<int>(Freshness::kLimitUnknown) == AX_LIMIT_UNKNOWN &&
         static_cast<int>(Freshness::kWrongClock) == AX_WRONG_CLOCK &&
         static_cast<int>(Freshness::kOtherClock) == AX_OTHER_CLOCK &&
         static_cast<int>(Freshness::kTimeUnknown) == AX_TIME_UNKNOWN &&
         static_cast<int>(Freshness::kTwoPublishers) == AX_TWO_PUBLISHERS &&
         static_cast<int>(CommandOutcome::kDone) == AX_DONE &&
         static_cast<int>(CommandOutcome::kDoneUnverified) == AX_DONE_UNVERIFIED &&
         static_cast<int>(CommandOutcome::kPrepared) == AX_PREPARED &&
         static_cast<int>(CommandOutcome::kRejected) == AX_REJECTED &&
         static_cast<int>(CommandOutcome::kExpired) == AX_EXPIRED &&
         static_cast<int>(CommandOutcome::kCancelled) == AX_CANCELLED &&
         static_cast<int>(CommandOutcome::kFailed) == AX_FAILED &&
         static_cast<int>(CommandOutcome::kIndeterminate) == AX_INDETERMINATE &&
         static_cast<int>(CommandOutcome::kNotAccepted) == AX_NOT_ACCEPTED &&
         static_cast<int>(CommandOutcome::kUnknown) == AX_UNKNOWN;
}
static_assert(SameOrder());
static_assert(int{AX_SET_AXES} == int{axlecast::position_set_t::MAX_AXES});
static_assert(int{AX_FLAG_VALID} == int{axlecast::position_t::FLAG_VALID});
static_assert(int{AX_FLAG_TURNS_VALID} == int{axlecast::position_t::FLAG_TURNS_VALID});
static_assert(int{AX_FLAG_REFERENCED} == int{axlecast::position_t::FLAG_REFERENCED});
static_assert(int{AX_FLAG_SPEED_VALID} == int{axlecast::position_t::FLAG_SPEED_VALID});
static_assert(int{AX_FLAG_SIMULATED} == int{axlecast::position_t::FLAG_SIMULATED});

}  // namespace

// NOLINTBEGIN(readability-identifier-naming, modernize-redundant-void-arg): names and declarations of C
extern "C" {

const char* ax_code_text(ax_code code) {
  switch (code) {
    case AX_OK:
      return "done";
    case AX_NO_POSITION:
      return "there is no position that may be used";
    case AX_NOT_YET:
      return "no outcome yet: the command is still followed";
    case AX_ARGUMENT:
      return "an argument is null or out of range";
    case AX_UNUSABLE:
      return "a port, a key or a thread does not work, or the settings do not ask for it";
    case AX_NOT_SENT:
      return "the system refused to send the message";
    case AX_MEMORY:
      return "out of memory";
  }
  return "unknown";
}

const char* ax_freshness_text(ax_freshness freshness) { return ReasonText(static_cast<Freshness>(freshness)); }

const char* ax_outcome_text(ax_outcome outcome) {
  static constexpr std::array<const char*, 10> kTexts = {"done and verified",
                                                         "done, not verified",
                                                         "prepared",
                                                         "rejected",
                                                         "expired",
                                                         "cancelled",
                                                         "failed, perhaps in part",
                                                         "indeterminate: look at the device",
                                                         "not accepted",
                                                         "not known: ask for the id later"};
  return outcome >= AX_DONE && outcome <= AX_UNKNOWN ? kTexts[static_cast<std::size_t>(outcome)] : "unknown";
}

int64_t ax_now_ns(void) { return axlecast::Connection::Now(); }

void ax_settings_init(ax_settings* settings) {
  if (settings == nullptr) return;
  *settings = ax_settings{};
  settings->data_url = "udpm://239.255.76.67:7667?ttl=0";
  settings->command_url = "udpm://239.255.76.67:7668?ttl=0";
}

ax_connection* ax_connect(const ax_settings* settings, ax_error* error) {
  return Opened<ax_connection>(error, [&]() -> std::unique_ptr<ax_connection> {
    if (settings == nullptr) {
      Report(error, AX_ARGUMENT, "settings is null");
      return nullptr;
    }
    axlecast::ConnectionSettings made;
    made.data_url = Text(settings->data_url);
    made.command_url = Text(settings->command_url);
    made.prefix = Text(settings->prefix);
    made.machine = Text(settings->machine);
    made.bridge_key = Text(settings->bridge_key);
    if (settings->commands != 0)
      made.commands = {Text(settings->command_key_file), Text(settings->command_key_credential)};
    if (settings->permits != 0)
      made.permits = {Text(settings->permit_key_file), Text(settings->permit_key_credential)};
    auto connection = std::make_unique<ax_connection>(made);
    const axlecast::Result<> usable = connection->connection.state();
    if (usable) return connection;
    Report(error, AX_UNUSABLE, usable.error().text);
    return nullptr;
  });
}

void ax_disconnect(ax_connection* connection) { delete connection; }

ax_code ax_on_base(const ax_connection* connection, int64_t mono_ns, ax_instant* instant) {
  if (connection == nullptr || instant == nullptr) return AX_ARGUMENT;
  *instant = ToC(connection->connection.OnBase(mono_ns));
  return instant->base_id != 0 ? AX_OK : AX_NO_POSITION;
}

ax_axis* ax_axis_open(ax_connection* connection, const char* device, const ax_axis_options* options,
                      ax_error* error) {
  return Opened<ax_axis>(error, [&]() -> std::unique_ptr<ax_axis> {
    if (connection == nullptr || !IsName(device)) {
      Report(error, AX_ARGUMENT, "the connection is null, or the name is not that of a device");
      return nullptr;
    }
    Axis::Options made;
    if (options != nullptr) {
      made.max_age_ns = std::max<std::int64_t>(options->max_age_ns, 0);
      if (options->max_extrapolation_ns > 0) made.max_extrapolation_ns = options->max_extrapolation_ns;
      if (options->max_gap_ns > 0) made.max_gap_ns = options->max_gap_ns;
      made.max_time_half_width_ns = std::max<std::int64_t>(options->max_time_half_width_ns, 0);
    }
    return std::make_unique<ax_axis>(connection->connection, device, made);
  });
}

void ax_axis_close(ax_axis* axis) { delete axis; }

ax_code ax_axis_latest(const ax_axis* axis, ax_position* position) {
  return axis == nullptr || position == nullptr ? AX_ARGUMENT : Fill(axis->axis.Latest(), *position);
}

ax_code ax_axis_at(const ax_axis* axis, int64_t mono_ns, ax_position* position) {
  return axis == nullptr || position == nullptr ? AX_ARGUMENT : Fill(axis->axis.At(mono_ns), *position);
}

ax_code ax_axis_allow(ax_axis* axis, const char* const* operations, size_t n_operations, int32_t valid_ms) {
  return Guarded([&] {
    if (axis == nullptr || (operations == nullptr && n_operations > 0)) return AX_ARGUMENT;
    if (n_operations > axlecast::PermitIssuer::kMaxOperations) return AX_ARGUMENT;
    if (!axis->axis.permits_state()) return AX_UNUSABLE;
    std::vector<std::string> made;
    made.reserve(n_operations);
    for (std::size_t i = 0; i < n_operations; ++i) made.push_back(Text(operations[i]));
    return axis->axis.Allow(made, valid_ms) ? AX_OK : AX_ARGUMENT;
  });
}

ax_code ax_axis_withdraw(ax_axis* axis) {
  return Guarded([&] {
    if (axis == nullptr) return AX_ARGUMENT;
    if (!axis->axis.permits_state()) return AX_UNUSABLE;
    return axis->axis.Withdraw() ? AX_OK : AX_NOT_SENT;
  });
}

void ax_id_text(const ax_id* id, char text[33]) {
  if (id == nullptr || text == nullptr) return;
  for (std::size_t i = 0; i < sizeof id->bytes; ++i) {
    static_cast<void>(std::snprintf(text + 2 * i, 3, "%02x", static_cast<unsigned>(id->bytes[i])));
  }
}

ax_code ax_id_parse(const char* text, ax_id* id) {
  return Guarded([&] {
    const std::optional<CommandId> parsed = id == nullptr ? std::nullopt : axlecast::ParseId(Text(text));
    if (!parsed) return AX_ARGUMENT;
    std::copy(parsed->begin(), parsed->end(), std::begin(id->bytes));
    return AX_OK;
  });
}

void ax_command_init(ax_command* command, const char* operation) {
  if (command == nullptr) return;
  *command = ax_command{};
  command->operation = operation;
  command->valid_ms = 5'000;
  command->expect_epoch = -1;
}

ax_code ax_axis_send(ax_axis* axis, const ax_command* command, ax_id* id, ax_error* error) {
  const ax_code code = Guarded([&] {
    if (axis == nullptr || command == nullptr || id == nullptr) return AX_ARGUMENT;
    if (command->operation == nullptr || (command->arguments == nullptr && command->n_arguments > 0))
      return AX_ARGUMENT;
    if (!axis->axis.commands_state()) return AX_UNUSABLE;
    axlecast::CommandRequest request;
    request.operation = command->operation;
    for (std::size_t i = 0; i < command->n_arguments; ++i) {
      request.arguments.emplace_back(Text(command->arguments[i].key), Text(command->arguments[i].value));
    }
    request.valid_ms = command->valid_ms;
    request.expect_epoch = command->expect_epoch;
    request.reason = Text(command->reason);
    const CommandId sent = axis->axis.Send(std::move(request));
    std::copy(sent.begin(), sent.end(), std::begin(id->bytes));
    return AX_OK;
  });
  return Report(error, code, code == AX_OK ? "" : ax_code_text(code));
}

ax_code ax_axis_await(ax_axis* axis, const ax_id* id, int64_t timeout_ms, ax_result* result) {
  return Guarded([&] {
    if (axis == nullptr || id == nullptr || result == nullptr) return AX_ARGUMENT;
    return Fill(axis->axis.Await(FromC(*id), timeout_ms), *result);
  });
}

ax_code ax_axis_cancel(ax_axis* axis, const ax_id* id) {
  return Guarded([&] {
    if (axis == nullptr || id == nullptr) return AX_ARGUMENT;
    axis->axis.Cancel(FromC(*id));
    return AX_OK;
  });
}

ax_code ax_axis_query(ax_axis* axis, const ax_id* id, int64_t timeout_ms, ax_result* result) {
  return Guarded([&] {
    if (axis == nullptr || id == nullptr || result == nullptr) return AX_ARGUMENT;
    return Fill(axis->axis.Query(FromC(*id), timeout_ms), *result);
  });
}

ax_set* ax_set_open(ax_connection* connection, const char* name, ax_error* error) {
  return Opened<ax_set>(error, [&]() -> std::unique_ptr<ax_set> {
    if (connection == nullptr || !IsName(name)) {
      Report(error, AX_ARGUMENT, "the connection is null, or the name is not that of a set");
      return nullptr;
    }
    return std::make_unique<ax_set>(connection->connection, name);
  });
}

void ax_set_close(ax_set* set) { delete set; }

ax_code ax_set_read(const ax_set* set, ax_set_reading* reading) {
  return Guarded([&] {
    if (set == nullptr || reading == nullptr) return AX_ARGUMENT;
    const std::optional<axlecast::PositionSet::Reading> newest = set->set.Newest();
    if (!newest) return AX_NO_POSITION;
    *reading = ax_set_reading{};
    reading->state = static_cast<ax_set_state>(newest->set.state);
    reading->tick = newest->set.tick;
    reading->tick_ns = newest->set.tick_ns;
    reading->base_id = newest->set.base_id;
    reading->earliest_ns = newest->set.earliest_ns;
    reading->latest_ns = newest->set.latest_ns;
    reading->limit_ns = newest->set.limit_ns;
    reading->since_arrival_ns = ax_now_ns() - newest->received_ns;
    reading->lost = newest->lost;
    reading->n_axes = static_cast<std::int32_t>(newest->set.axes.size());
    for (std::size_t i = 0; i < newest->set.axes.size(); ++i)
      Fill(newest->set.axes[i], newest->set.tick_ns, reading->axes[i]);
    return AX_OK;
  });
}

}  // extern "C"
// NOLINTEND(readability-identifier-naming, modernize-redundant-void-arg)
