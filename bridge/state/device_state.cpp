#include "bridge/state/device_state.h"

#include <algorithm>
#include <axlecast/device_info_t.hpp>
#include <cmath>
#include <cstdlib>
#include <sstream>
#include <utility>

#include "core/alarm/alarm_table.h"
#include "core/base/spelling.h"
#include "core/base/text.h"
#include "core/command/commands.h"
#include "core/device/operation.h"

namespace axlecast {
namespace {

using S = command_status_t;

// Two readings at rest differ by the noise of each, and by a thousandth of a turn of play and drift.
std::int64_t RestingCounts(const DeviceSettings& settings) {
  return std::max(2 * settings.noise_counts, settings.counts_per_turn / 1'000);
}

// Returns the shortest way: whole windows cannot be distinguished.
std::int64_t Wrapped(std::int64_t way, std::int64_t window) {
  const std::int64_t within = ((way % window) + window) % window;
  return within > window / 2 ? within - window : within;
}

constexpr const char* kUndone = "undone";

BridgeCommand Restoring(const DatumRecord& datum) {
  BridgeCommand command{"set_datum",
                        {{"counts", std::to_string(datum.counts)}, {"utime", std::to_string(datum.utime)}}};
  if (!datum.identity.empty()) command.arguments.push_back({"identity", datum.identity});
  return command;
}

bool NothingWasDone(std::int8_t state) {
  return state == S::STATE_REJECTED || state == S::STATE_EXPIRED || state == S::STATE_CANCELLED;
}

bool IsAnswering(const driver_device_t& reported) {
  return reported.state == device_info_t::STATE_ONLINE || reported.state == device_info_t::STATE_DEGRADED;
}

tl::unexpected<Error> NotJournalled() {
  return Failure("the journal cannot note what it changes: see ALARM/bridge; nothing was done", S::REASON_JOURNAL);
}

// Returns the reason for the history of a datum that a command made void.
std::string VoidReason(const PendingCommand& pending) {
  return std::string(pending.operation->name) + ' ' + IdText(pending.id);
}

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

ShaftTravel Travelled(const DeviceConfig& device, std::int64_t before, std::int64_t after) {
  const DeviceSettings& settings = *device.settings;
  const bool single_turn = settings.turns_range <= 1;
  const std::int64_t window = settings.counts_per_turn * std::max<std::int64_t>(settings.turns_range, 1);
  ShaftTravel travel;
  travel.counts = Wrapped(after - before, window);
  travel.turns = static_cast<double>(travel.counts) / static_cast<double>(settings.counts_per_turn);
  const std::int64_t way = std::abs(travel.counts);
  if (way <= RestingCounts(settings)) {
    travel.verdict = ShaftTravel::Verdict::kResting;
  } else if (single_turn) {
    travel.verdict = ShaftTravel::Verdict::kTurnsUnknown;
  } else {
    travel.verdict = way <= window / 4 ? ShaftTravel::Verdict::kWithinWindow : ShaftTravel::Verdict::kBeyondWindow;
  }
  return travel;
}

std::string TravelText(const ShaftTravel& travel, const DeviceConfig& device, std::int64_t away_us) {
  const double away_s = static_cast<double>(away_us) / 1e6;
  const auto range = static_cast<long long>(device.settings->turns_range);
  switch (travel.verdict) {
    case ShaftTravel::Verdict::kResting:
      return Text("did not move in the %.1f s without its driver", away_s);
    case ShaftTravel::Verdict::kWithinWindow:
      return Text("moved by %.4f turns in the %.1f s without its driver; the encoder distinguishes %lld turns",
                  travel.turns, away_s, range);
    case ShaftTravel::Verdict::kBeyondWindow:
      return Text(
          "moved by %.4f turns or further in the %.1f s without its driver: more than a quarter of the %lld turns "
          "that the encoder distinguishes; check its place",
          travel.turns, away_s, range);
    case ShaftTravel::Verdict::kTurnsUnknown:
      return Text(
          "its angle changed by %.4f turns in the %.1f s without its driver, besides any number of whole turns: a "
          "single-turn encoder cannot detect them; check its place",
          travel.turns, away_s);
  }
  return "";
}

std::optional<BridgeCommand> AxisStateStore::OnHello(const DeviceConfig& device, const driver_device_t& reported,
                                                     std::int64_t boot_id, bool idle, Timestamp now) {
  Seen& seen = seen_[device.name];
  if (seen.boot != boot_id) {
    const Seen before = std::exchange(seen, Seen{});
    seen.boot = boot_id;
    seen.exchanged = before.exchanged;
    seen.doubtful = before.doubtful;
  }
  const AxisRecord record = store_.Find(device.name);
  if (UpdateReference(device.name, reported, record.reference_lost, seen, now))
    return BridgeCommand{"mark_reference_lost", {}};
  if (!IsAnswering(reported) || !reported.has_position) return std::nullopt;
  seen.identity = reported.identity;
  if (!seen.compared) CompareAfterRestart(device, reported, record, seen, now);
  if (seen.exchanged) return std::nullopt;
  store_.KeepPosition(device.name, {reported.position, reported.position_utime});
  // A datum of the file has no time; one that somebody set since counts more.
  if (reported.has_datum && reported.datum_utime != 0) seen.restored = true;
  if (!record.datum || seen.restored || !idle) return std::nullopt;
  return Restoring(*record.datum);
}

// Returns true if the driver must receive that the reference is lost.
bool AxisStateStore::UpdateReference(const std::string& device, const driver_device_t& reported, bool was_lost,
                                     Seen& seen, Timestamp now) {
  if (reported.reference_lost) {
    seen.reported_lost = true;
    if (!was_lost && store_.Apply(device, ReferenceChanged{true})) {
      Note(device, "reference_lost", "its driver reports that the reference is lost", now);
    }
    return false;
  }
  if (!was_lost) return false;
  // Only a boot that has reported the loss can report that the reference was restored.
  if (!seen.reported_lost) return true;
  if (store_.Apply(device, ReferenceChanged{false}))
    Note(device, "reference_restored", "the reference holds again", now);
  return false;
}

// The first valid position of a driver's boot: is it the same encoder, and where has the shaft gone?
void AxisStateStore::CompareAfterRestart(const DeviceConfig& device, const driver_device_t& reported,
                                         const AxisRecord& record, Seen& seen, Timestamp now) {
  seen.compared = true;
  const bool other = !record.identity.empty() && !reported.identity.empty() && record.identity != reported.identity;
  if (other && !seen.exchanged) {
    Note(device.name, "encoder_exchanged",
         "another encoder answers: " + reported.identity + " in the place of " + record.identity +
             "; its datum is not given to it: axlecast replace " + device.name,
         now);
  }
  seen.exchanged = other;
  if (other) return;
  if (record.identity.empty() && !reported.identity.empty()) {
    static_cast<void>(
        store_.Apply(device.name, IdentityChanged{reported.identity}));  // tried again with the next boot
  }
  if (!record.position || !device.settings) return;
  const ShaftTravel travel = Travelled(device, record.position->counts, reported.position);
  const std::string text = TravelText(travel, device, reported.position_utime - record.position->utime);
  seen.doubtful = seen.doubtful || travel.verdict == ShaftTravel::Verdict::kBeyondWindow;
  if (travel.verdict != ShaftTravel::Verdict::kResting) Note(device.name, "moved_while_away", text, now);
}

Result<> AxisStateStore::BeforeRoute(const DeviceConfig& device, PendingCommand& pending, Timestamp now) {
  const OperationSpec& operation = *pending.operation;
  if (const std::int32_t writes = pending.WritesAtMost(); writes > 0) {
    const std::int64_t so_far = store_.Find(device.name).writes;
    const std::int64_t budget = device.settings ? device.settings->write_budget : 0;
    if (budget > 0 && so_far + writes > budget) {
      return Failure("its memory has had " + std::to_string(so_far) + " of the " + std::to_string(budget) +
                         " writes that the maker allows: exchange it (axlecast replace " + device.name + ")",
                     S::REASON_WEAR);
    }
    if (!pending.prepare && !store_.Apply(device.name, WritesAdded{writes, now.utime})) return NotJournalled();
    pending.reserved_writes = pending.prepare ? 0 : writes;
  }
  if (!operation.moves_datum || pending.prepare) return {};
  const AxisRecord record = store_.Find(device.name);
  if (!record.datum && !record.position) return {};
  if (!store_.Apply(device.name, DatumVoided{now.utime, VoidReason(pending)})) return NotJournalled();
  return {};
}

void AxisStateStore::OnOutcome(const DeviceConfig& device, PendingCommand& pending, Timestamp now) {
  const S& status = pending.status;
  if (pending.prepare || pending.operation == nullptr) return;
  if (pending.purpose == PendingCommand::Purpose::kRestore) {
    if (status.state == S::STATE_SUCCEEDED && pending.operation->name == "set_datum") {
      Note(device.name, "datum_restored", "its driver was given the datum back: " + status.text, now);
    }
    if (status.reason_code == S::REASON_WRONG_IDENTITY) seen_[device.name].exchanged = true;
    return;
  }
  SettleWrites(pending, now);
  if (status.operation == "accept_exchange") return AcceptExchange(pending, now);
  if (pending.operation->name == "set_datum" && status.state == S::STATE_SUCCEEDED) return KeepDatum(pending, now);
  if (pending.operation->name == "clear_datum" && status.state == S::STATE_SUCCEEDED) {
    static_cast<void>(store_.Apply(device.name, DatumVoided{now.utime, kUndone}));
  }
  if (pending.operation->moves_datum && NothingWasDone(status.state)) RestoreDatum(pending);
}

// Subtracts writes that were counted but not made. After INDETERMINATE, all of them stay counted.
void AxisStateStore::SettleWrites(PendingCommand& pending, Timestamp now) {
  if (pending.reserved_writes == 0 || pending.status.state == S::STATE_INDETERMINATE) return;
  const std::int32_t unused = std::max(pending.reserved_writes - pending.nv_writes, 0);
  if (unused > 0) static_cast<void>(store_.Apply(pending.device, WritesAdded{-unused, now.utime}));
  pending.reserved_writes = 0;
}

void AxisStateStore::KeepDatum(PendingCommand& pending, Timestamp now) {
  const auto counts = ParseInteger(ChangedTo(pending.status, "datum_counts"));
  if (!counts) return;
  DatumRecord datum;
  datum.counts = *counts;
  datum.utime = ParseInteger(ArgumentOf(pending, "utime")).value_or(now.utime);
  datum.identity = ChangedTo(pending.status, "identity");
  datum.value = ChangedTo(pending.status, "value");
  datum.who = pending.who;
  datum.command = pending.id;
  datum.reason = pending.reason;
  seen_[pending.device].doubtful = false;
  if (store_.Apply(pending.device, datum)) return;
  pending.status.text = CappedText(
      pending.status.text + "; the journal could not keep it: it is lost when the driver ends", kTextBytes);
}

// The datum that the command would have made void is in force again.
void AxisStateStore::RestoreDatum(const PendingCommand& pending) {
  if (store_.Find(pending.device).datum) return;
  const std::vector<DatumRecord> datums = store_.Datums(pending.device);
  if (datums.empty() || datums.front().void_reason != VoidReason(pending)) return;
  static_cast<void>(store_.Apply(pending.device, datums.front()));
}

void AxisStateStore::AcceptExchange(PendingCommand& pending, Timestamp now) {
  S& status = pending.status;
  const bool of_file = status.reason_code == S::REASON_NOT_PERMITTED;
  if (status.state != S::STATE_SUCCEEDED && status.reason_code != S::REASON_NO_DATUM && !of_file) return;
  Seen& seen = seen_[pending.device];
  const bool kept = store_.Apply(pending.device, EncoderExchanged{seen.identity, now.utime});
  status.state = kept ? S::STATE_SUCCEEDED : S::STATE_FAILED;
  status.verified = kept ? 1 : 0;
  status.reason_code = std::int32_t{S::REASON_NONE};
  if (!kept) status.reason_code = S::REASON_JOURNAL;
  status.changes = {{"identity", "", seen.identity}};
  status.n_changes = 1;
  status.text = !kept     ? "the journal could not note it: see ALARM/bridge, then repeat it"
                : of_file ? "wear restarts; the machine's file gives a datum of the old encoder: change it"
                          : "wear and datum restart: home the axis";
  if (!kept) return;
  seen.exchanged = seen.doubtful = false;
  Note(pending.device, "exchange_accepted", "by " + pending.who + ": " + status.text, now);
}

Result<> AxisStateStore::Substitute(const Family& family, PendingCommand& pending) const {
  if (!pending.operation->executed_by_bridge) return {};
  BridgeCommand command{"clear_datum", {}};
  if (pending.operation->name == "undo_datum") {
    auto undo = UndoDatum(pending.device);
    if (!undo) return Failure(undo.error());
    command = *std::move(undo);
  }
  pending.operation = FindOperation(family, command.operation);
  pending.arguments = std::move(command.arguments);
  return {};
}

Result<BridgeCommand> AxisStateStore::UndoDatum(const std::string& device) const {
  const auto present = store_.Find(device).datum;
  if (!present) {
    return Failure("no datum is in force: none was set, or the encoder's own origin was moved since; home the axis",
                   S::REASON_NO_DATUM);
  }
  const std::vector<DatumRecord> datums = store_.Datums(device);
  const auto before = std::find_if(datums.begin(), datums.end(),
                                   [&](const DatumRecord& datum) { return datum.number < present->number; });
  const bool none = before == datums.end() || before->void_reason == kUndone;
  if (none) return BridgeCommand{"clear_datum", {}};
  if (before->voided_utime != 0) {
    return Failure("the encoder's own origin was moved after the datum before (" + before->void_reason +
                       "): home the axis instead",
                   S::REASON_NO_DATUM);
  }
  return Restoring(*before);
}

bool AxisStateStore::AnyExchanged() const {
  return std::any_of(seen_.begin(), seen_.end(), [](const auto& entry) { return entry.second.exchanged; });
}

bool AxisStateStore::AnyDoubtful() const {
  return std::any_of(seen_.begin(), seen_.end(), [](const auto& entry) { return entry.second.doubtful; });
}

void AxisStateStore::Note(const std::string& device, const char* kind, std::string text, Timestamp now) {
  const AxisEvent event{now.utime, device, kind, std::move(text)};
  store_.Note(event);
  on_event_(event);
}

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

Result<> AlarmStateStore::BeforeRoute(const PendingCommand& pending, Timestamp now) const {
  if (pending.operation->name != kShelveAlarm ||
      HasRoomFor(pending.device, ArgumentOf(pending, "alarm"), now.utime))
    return {};
  return Failure(AlarmShelves::FullText(), S::REASON_BAD_ARGUMENT);
}

bool AlarmStateStore::HasRoomFor(const std::string& device, const std::string& alarm, std::int64_t utime) const {
  const std::vector<AlarmMark> marks = store_.Marks(device);
  const auto others = std::count_if(marks.begin(), marks.end(), [&](const AlarmMark& mark) {
    return mark.kind == Kind::kShelved && mark.alarm != alarm && mark.until_utime > utime;
  });
  return static_cast<std::size_t>(others) < AlarmShelves::kMax;
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
  // An outcome that comes late may find no room any more.
  const bool has_room = kind != Kind::kShelved || HasRoomFor(pending.device, mark.alarm, mark.utime);
  if (has_room && store_.Apply(pending.device, mark)) return;
  const std::string why = has_room ? "the journal could not keep it" : AlarmShelves::FullText();
  status.text = CappedText(status.text + "; " + why + ": it is lost when the driver ends", kTextBytes);
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
