#include "tools/monitor/monitor.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "core/base/spelling.h"
#include "core/messages/json/field.h"

namespace axlecast {
namespace {

bool SameId(const command_status_t& one, const command_status_t& other) {
  return std::equal(std::begin(one.id), std::end(one.id), std::begin(other.id));
}

constexpr std::string_view kHealthChannel = "RECORDER/";
constexpr std::string_view kRecorderAlarms = "ALARM/recorder/";

}  // namespace

bool CommandHistory::On(command_status_t status) {
  const auto state = static_cast<std::uint8_t>(status.state);
  if (state == command_status_t::STATE_UNKNOWN || state >= kStates) return false;
  const bool is_final = status.is_final != 0;
  const auto known = std::find_if(newest_.rbegin(), newest_.rend(),
                                  [&status](const command_status_t& other) { return SameId(other, status); });
  if (known == newest_.rend()) {
    if (newest_.size() == kMax) newest_.pop_front();
    newest_.push_back(std::move(status));
    last_ = newest_.size() - 1;
    if (is_final) ++outcomes_[state];
    return true;
  }
  // An outcome never changes; only a finding may follow it.
  const bool was_final = known->is_final != 0;
  const bool same = known->state == status.state && known->finding == status.finding &&
                    known->progress == status.progress && known->text == status.text;
  if (same || (was_final && known->state != status.state)) return false;
  *known = std::move(status);
  last_ = static_cast<std::size_t>(std::distance(known, newest_.rend())) - 1;
  if (is_final && !was_final) ++outcomes_[state];
  return true;
}

std::optional<std::int8_t> RecorderView::State(MonoNs now) const {
  if (!health || now - health_at > kStaleAfter) return std::nullopt;
  return health->state;
}

bool RecorderView::Ended(MonoNs now) const {
  return health && !State(now) && health->state == recorder_health_t::STATE_STOPPING;
}

Monitor::Monitor(const MachineConfig& machine) : machine_(machine, Unlisted::kShown) {
  listed_recorders_.insert(machine.machine);  // the name of a recorder without --name
  for (const LogConfig& log : machine.recorder.logs) listed_recorders_.insert(log.name);
}

MonitorUpdate Monitor::OnMessage(std::string_view channel, Bytes message, MonoNs now) {
  const MonitorUpdate update = message.size() > kLargestMessage ? MonitorUpdate{} : Take(channel, message, now);
  if (update.kind == MonitorUpdate::Kind::kNothing) {
    ++passed_over_;
    return update;
  }
  auto count = channels_.find(channel);
  if (count == channels_.end()) count = channels_.emplace(channel, SequenceCount()).first;
  if (const auto head = ReadHead(message)) count->second.On(head->boot_id, head->seq);
  return update;
}

MonitorUpdate Monitor::Take(std::string_view channel, Bytes message, MonoNs now) {
  if (channel == kCommandChannels) {
    auto status = DecodeMessage<command_status_t>(message);
    if (!status) return {};
    const bool news = commands_.On(std::move(*status));
    return {.kind = MonitorUpdate::Kind::kCommand, .index = commands_.last(), .changed = news};
  }
  if (channel.starts_with(kHealthChannel)) return OnRecorder(channel.substr(kHealthChannel.size()), message, now);
  if (channel.starts_with(kRecorderAlarms)) {
    return OnRecorderAlarms(channel.substr(kRecorderAlarms.size()), message, now);
  }
  return machine_.OnMessage(channel, message, now);
}

RecorderView* Monitor::RecorderOf(std::string_view name) {
  const auto known =
      std::ranges::find_if(recorders_, [name](const RecorderView& recorder) { return recorder.name == name; });
  if (known != recorders_.end()) return &*known;
  const bool listed = listed_recorders_.contains(name);
  const auto others = static_cast<std::size_t>(std::ranges::count(recorders_, false, &RecorderView::listed));
  if (!IsName(name) || (!listed && others >= kMaxRecorders)) return nullptr;
  RecorderView& recorder = recorders_.emplace_back();
  recorder.name = name;
  recorder.listed = listed;
  return &recorder;
}

MonitorUpdate Monitor::OnRecorder(std::string_view name, Bytes message, MonoNs now) {
  auto health = DecodeMessage<recorder_health_t>(message);
  RecorderView* recorder = health ? RecorderOf(name) : nullptr;
  if (recorder == nullptr) return {};
  const bool news = !recorder->health || recorder->health->state != health->state;
  recorder->health = std::move(health);
  recorder->health_at = now;
  return {.kind = MonitorUpdate::Kind::kRecorder,
          .index = static_cast<std::size_t>(recorder - recorders_.data()),
          .changed = news};
}

MonitorUpdate Monitor::OnRecorderAlarms(std::string_view name, Bytes message, MonoNs now) {
  auto alarm = DecodeMessage<alarm_t>(message);
  RecorderView* recorder = alarm ? RecorderOf(name) : nullptr;
  if (recorder == nullptr) return {};
  return {.kind = MonitorUpdate::Kind::kRecorderAlarms,
          .index = static_cast<std::size_t>(recorder - recorders_.data()),
          .changed = recorder->alarms.On(std::move(*alarm), now)};
}

}  // namespace axlecast
