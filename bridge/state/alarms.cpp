#include "bridge/state/alarms.h"

#include <algorithm>
#include <sstream>

#include "bridge/state/command_store.h"
#include "core/base/spelling.h"
#include "core/base/text.h"
#include "core/command/operation_check.h"

namespace axlecast {
namespace {

using S = command_status_t;
using Kind = AlarmMark::Kind;

BridgeCommand Restoring(const AlarmMark& mark) {
  if (mark.kind == Kind::kAcknowledged) {
    return {std::string(kRestoreAcknowledgement), {{"alarm", mark.alarm}}};
  }
  return {std::string(kShelveAlarm),
          {{"alarm", mark.alarm}, {"until", std::to_string(mark.until_utime)}, {"up_to", mark.up_to}}};
}

// Of an alarm that is present; who acknowledges it once more is not who has acknowledged it.
bool IsFirstAcknowledgement(const S& status) {
  return std::any_of(status.changes.begin(), status.changes.end(), [](const change_t& change) {
    return change.key == "alarm" && change.after == "acknowledged" && change.before != "acknowledged";
  });
}

// Returns false also if the list is incomplete.
bool LeavesOut(const std::string& list, const std::string& alarm) {
  std::istringstream words(list);
  for (std::string word; words >> word;) {
    if (word == alarm || word == kAndMore) return false;
  }
  return true;
}

}  // namespace

std::optional<BridgeCommand> AlarmStateStore::OnHello(const std::string& device, std::int64_t boot_id,
                                                      Timestamp now) {
  std::optional<BridgeCommand> command;
  for (const AlarmMark& mark : store_.Marks(device)) {
    if (mark.kind == Kind::kShelved && mark.until_utime <= now.utime) {
      static_cast<void>(store_.Apply(device, AlarmMarkEnded{mark.kind, mark.alarm}));  // with the next HELLO again
    } else if (mark.driver_boot_id != boot_id && !command) {
      command = Restoring(mark);
    }
  }
  return command;
}

void AlarmStateStore::OnAcknowledged(const driver_status_t& status) {
  for (const AlarmMark& mark : store_.Marks(status.device)) {
    const bool knew = mark.driver_boot_id == status.boot_id && mark.known_utime < status.utime;
    if (mark.kind != Kind::kAcknowledged || !knew || !LeavesOut(status.text, mark.alarm)) continue;
    static_cast<void>(store_.Apply(
        status.device, AlarmMarkEnded{mark.kind, mark.alarm}));  // a failure is repeated with the next status
  }
}

void AlarmStateStore::OnOutcome(PendingCommand& pending) {
  if (pending.prepare || pending.operation == nullptr || !IsAboutAlarms(pending.operation->name)) return;
  if (pending.purpose == PendingCommand::Purpose::kRestore) return Restored(pending);
  if (pending.status.state != S::STATE_SUCCEEDED) return;
  if (pending.operation->name == kShelveAlarm) return Keep(pending, Kind::kShelved);
  if (pending.operation->name == kUnshelveAlarm) {
    static_cast<void>(store_.Apply(pending.device, AlarmMarkEnded{Kind::kShelved, ArgumentOf(pending, "alarm")}));
  } else if (IsFirstAcknowledgement(pending.status)) {
    Keep(pending, Kind::kAcknowledged);
  }
}

void AlarmStateStore::Keep(PendingCommand& pending, Kind kind) {
  S& status = pending.status;
  const AlarmMark mark = {.kind = kind,
                          .alarm = ArgumentOf(pending, "alarm"),
                          .utime = status.finished_utime,
                          .until_utime = ParseInteger(ChangedTo(status, "until")).value_or(0),
                          .up_to = ChangedTo(status, "up_to"),
                          .who = pending.who,
                          .reason = pending.reason,
                          .command = pending.id,
                          .driver_boot_id = status.driver_boot_id,
                          .known_utime = status.finished_utime};
  if (store_.Apply(pending.device, mark)) return;
  status.text =
      CappedText(status.text + "; the journal could not keep it: it is lost when the driver ends", kTextBytes);
}

// A driver that has refused it is not asked for ever.
void AlarmStateStore::Restored(const PendingCommand& pending) {
  const S& status = pending.status;
  if (status.state != S::STATE_SUCCEEDED && status.state != S::STATE_REJECTED) return;
  const Kind kind = pending.operation->name == kShelveAlarm ? Kind::kShelved : Kind::kAcknowledged;
  for (AlarmMark& mark : store_.Marks(pending.device)) {
    if (mark.kind != kind || mark.alarm != ArgumentOf(pending, "alarm")) continue;
    mark.driver_boot_id = status.driver_boot_id;
    mark.known_utime = status.finished_utime;
    static_cast<void>(store_.Apply(pending.device, mark));  // else it is given once more
  }
}

}  // namespace axlecast
