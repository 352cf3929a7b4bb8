#include "tools/metrics/metrics_text.h"

#include <algorithm>
#include <array>
#include <cstdint>

#include "core/messages/enum_names.h"
#include "tools/metrics/exposition.h"

namespace axlecast {
namespace {

using Type = Exposition::Type;

// recorder_health_t STATE_*, and for a recorder that ended or does not report.
constexpr std::array<std::string_view, 7> kRecorderStates = {"recording", "pre_trigger", "disk_full", "error",
                                                             "stopping",  "ended",       "silent"};
constexpr std::int8_t kRecorderEnded = 5;

// command_status_t STATE_*, of those that are final.
struct Outcome {
  std::int8_t state;
  std::string_view name;
};
constexpr std::array<Outcome, 6> kOutcomes = {{{command_status_t::STATE_SUCCEEDED, "succeeded"},
                                               {command_status_t::STATE_REJECTED, "rejected"},
                                               {command_status_t::STATE_FAILED, "failed"},
                                               {command_status_t::STATE_EXPIRED, "expired"},
                                               {command_status_t::STATE_CANCELLED, "cancelled"},
                                               {command_status_t::STATE_INDETERMINATE, "indeterminate"}}};

// Calls use(origin, name, alarms) for every listed sender. `origin` is device, bridge or recorder.
template <typename Use>
void EachSender(const Monitor& monitor, Use use) {
  for (const DeviceView& device : monitor.machine().devices()) {
    if (device.listed) use("device", device.name, device.alarms);
  }
  use("bridge", "bridge", monitor.machine().bridge());
  for (const RecorderView& recorder : monitor.recorders()) {
    if (recorder.listed) use("recorder", recorder.name, recorder.alarms);
  }
}

void AddAlarms(Exposition& out, const Monitor& monitor) {
  out.Family("axlecast_alarm", Type::kGauge,
             "An active alarm, as last reported by its sender; always 1. At most the eight worst of each sender.");
  EachSender(monitor, [&out](std::string_view origin, std::string_view name, const AlarmView& alarms) {
    for (const alarm_entry_t& entry : alarms.entries()) {
      out.Add({{"origin", origin},
               {"name", name},
               {"alarm", entry.name},
               {"severity", SeverityName(entry.severity)},
               {"state", AlarmStateName(entry.state)}},
              std::int64_t{1});
    }
  });
  out.Family("axlecast_alarms", Type::kGauge, "Active alarms, including those beyond the eight worst.");
  EachSender(monitor, [&out](std::string_view origin, std::string_view name, const AlarmView& alarms) {
    if (alarms.received()) out.Add({{"origin", origin}, {"name", name}}, static_cast<std::int64_t>(alarms.total()));
  });
}

template <typename Value>
void EachRecorder(Exposition& out, const Monitor& monitor, Value value) {
  for (const RecorderView& recorder : monitor.recorders()) {
    if (recorder.listed && recorder.health) out.Add({{"recorder", recorder.name}}, value(*recorder.health));
  }
}

void AddRecorders(Exposition& out, const Monitor& monitor, MonoNs now) {
  out.Family("axlecast_recorder_state", Type::kGauge,
             "1 for the state the recorder is in, else 0; ended: it was stopped; silent: it does not report.");
  for (const RecorderView& recorder : monitor.recorders()) {
    if (!recorder.listed) continue;
    const auto state = recorder.Ended(now) ? kRecorderEnded : recorder.State(now);
    AddStateSet(out, "recorder", recorder.name, kRecorderStates, state);
  }
  out.Family("axlecast_recorder_messages_total", Type::kCounter, "Messages recorded since the recorder started.");
  EachRecorder(out, monitor, [](const recorder_health_t& health) { return health.messages; });
  out.Family("axlecast_recorder_written_bytes_total", Type::kCounter, "Bytes written since the recorder started.");
  EachRecorder(out, monitor, [](const recorder_health_t& health) { return health.total_bytes; });
  out.Family("axlecast_recorder_lost_messages_total", Type::kCounter,
             "Messages that are missing from the log, over all senders.");
  EachRecorder(out, monitor, [](const recorder_health_t& health) { return health.lost; });
  out.Family("axlecast_recorder_kernel_dropped_datagrams_total", Type::kCounter,
             "Datagrams that the kernel dropped at the recorder's socket.");
  EachRecorder(out, monitor, [](const recorder_health_t& health) { return health.kernel_dropped; });
  out.Family("axlecast_recorder_file_bytes", Type::kGauge, "Size of the file being written.");
  EachRecorder(out, monitor, [](const recorder_health_t& health) { return health.file_bytes; });
  out.Family("axlecast_recorder_free_bytes", Type::kGauge, "Free space on the recorder's disk.");
  EachRecorder(out, monitor, [](const recorder_health_t& health) { return health.free_bytes; });
}

void AddCommands(Exposition& out, const Monitor& monitor) {
  out.Family("axlecast_commands_total", Type::kCounter, "Commands whose outcome was received, by outcome.");
  for (const Outcome& outcome : kOutcomes) {
    out.Add({{"outcome", outcome.name}}, monitor.commands().outcomes(outcome.state));
  }
}

template <typename Views>
std::int64_t CountUnlisted(const Views& views) {
  return std::count_if(views.begin(), views.end(), [](const auto& view) { return !view.listed; });
}

// Returns false for channels of devices, buses and recorders that are not in the machine file: anybody can invent names.
bool HasSeries(const Monitor& monitor, std::string_view channel) {
  const std::string_view name = channel.substr(channel.rfind('/') + 1);
  const auto is_unlisted = [name](const auto& view) { return !view.listed && view.name == name; };
  if (channel.starts_with("BUS/") || channel.starts_with("BUS_TIMES/"))
    return std::ranges::none_of(monitor.machine().buses(), is_unlisted);
  if (channel.starts_with("RECORDER/") || channel.starts_with("ALARM/recorder/"))
    return std::ranges::none_of(monitor.recorders(), is_unlisted);
  return std::ranges::none_of(monitor.machine().devices(), is_unlisted);
}

void AddChannels(Exposition& out, const Monitor& monitor, std::int64_t (SequenceCount::*value)() const) {
  for (const auto& [channel, count] : monitor.channels()) {
    if (HasSeries(monitor, channel)) out.Add({{"channel", channel}}, (count.*value)());
  }
}

void AddReception(Exposition& out, const Monitor& monitor) {
  out.Family("axlecast_messages_received_total", Type::kCounter,
             "Messages that this process received, by channel.");
  AddChannels(out, monitor, &SequenceCount::received);
  out.Family("axlecast_messages_lost_total", Type::kCounter,
             "Messages that did not reach this process, by the gaps in their sequence numbers.");
  AddChannels(out, monitor, &SequenceCount::lost);
  out.Family("axlecast_messages_unusable_total", Type::kCounter,
             "Messages that were malformed or of no device, bus or recorder that there was room for.");
  out.Add({}, monitor.passed_over());
  out.Family("axlecast_unlisted_senders", Type::kGauge,
             "Devices, buses and recorders that are received and not in the machine's file; they have no series of "
             "their own.");
  out.Add({{"kind", "device"}}, CountUnlisted(monitor.machine().devices()));
  out.Add({{"kind", "bus"}}, CountUnlisted(monitor.machine().buses()));
  out.Add({{"kind", "recorder"}}, CountUnlisted(monitor.recorders()));
  const ReceptionCounts& reception = monitor.machine().reception();
  out.Family("axlecast_kernel_dropped_datagrams_total", Type::kCounter,
             "Datagrams that the kernel dropped because this process's receive buffer was full.");
  out.Add({}, reception.dropped);
  out.Family("axlecast_refused_datagrams_total", Type::kCounter,
             "Datagrams that this process refused: of other hosts although the URL has ttl=0, or not made by LCM.");
  out.Add({{"cause", "other_host"}}, reception.outside);
  out.Add({{"cause", "malformed"}}, reception.malformed);
}

}  // namespace

std::string MetricsText(const Monitor& monitor, MonoNs now, std::string_view version) {
  Exposition out;
  out.Family("axlecast_build_info", Type::kGauge, "The version of axlecast that exports these metrics; always 1.");
  out.Add({{"version", version}}, std::int64_t{1});
  out.Family("axlecast_machine_info", Type::kGauge, "The machine of the file; always 1.");
  out.Add({{"machine", monitor.machine().machine()}}, std::int64_t{1});
  AddDeviceMetrics(out, monitor.machine(), now);
  AddMotorMetrics(out, monitor.machine(), now);
  AddBusMetrics(out, monitor.machine(), now);
  AddAlarms(out, monitor);
  out.Family("axlecast_bridge_up", Type::kGauge, "1 while a bridge serves: commands can be given; else 0.");
  out.Add({}, std::int64_t{monitor.machine().bridge().Fresh(now)});
  AddRecorders(out, monitor, now);
  AddCommands(out, monitor);
  AddReception(out, monitor);
  return out.text();
}

}  // namespace axlecast
