#include "tools/axlecast/command/format_journal.h"

#include <algorithm>

#include "core/base/text.h"
#include "core/base/utc_text.h"
#include "core/command/commands.h"
#include "core/messages/enum_names.h"
#include "core/messages/json/field.h"
#include "core/messages/json/message_json.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;
using S = command_status_t;

constexpr std::size_t kTime = 19;
constexpr std::size_t kId = 8;
constexpr std::size_t kWho = 10;
constexpr std::size_t kDevice = 10;
constexpr std::size_t kOperation = 32;
constexpr std::size_t kOutcome = 13;

// Returns the first 8 digits of an id, or "-" if it is zero.
std::string ShortId(const CommandId& id) { return id == CommandId{} ? "-" : IdText(id).substr(0, kId); }

std::string Row(std::string_view time, std::string_view id, std::string_view who, std::string_view device,
                std::string_view operation, std::string_view outcome, std::string_view text) {
  std::string row = Left(time, kTime) + ' ' + Left(id, kId) + ' ' + Left(who, kWho) + ' ' + Left(device, kDevice) +
                    ' ' + Left(operation, kOperation) + ' ' + Left(outcome, kOutcome) + ' ' + std::string(text);
  row.erase(row.find_last_not_of(' ') + 1);
  return row + '\n';
}

// What was journalled of the network, made safe for a terminal.
std::string Shown(const std::string& text) { return CappedText(text, text.size()); }

std::string OperationText(const CommandRecord& record) {
  std::string text = Shown(record.status.operation);
  for (const argument_t& argument : record.arguments) {
    const std::string value = Shown(argument.value);
    const bool quoted = value.empty() || value.find(' ') != std::string::npos;
    text += ' ' + Shown(argument.key) + '=' + (quoted ? '"' + value + '"' : value);
  }
  return text;
}

// "no_permit: no fresh permit names it", "effect_seen, driver_silent: ..."
std::string CauseText(std::int8_t state, bool verified, std::int8_t finding, std::int32_t reason,
                      const std::string& text) {
  std::string cause;
  const auto add = [&cause](std::string_view word) {
    if (!cause.empty()) cause += ", ";
    cause += word;
  };
  if (state == S::STATE_SUCCEEDED) add(verified ? "verified" : "not verifiable");
  if (finding != S::FINDING_NONE) add(FindingName(finding));
  if (reason != S::REASON_NONE) add(ReasonName(reason));
  if (!cause.empty() && !text.empty()) cause += ": ";
  return cause + Shown(text);
}

std::string CauseText(const S& status) {
  return CauseText(status.state, status.verified != 0, status.finding, status.reason_code, status.text);
}

std::string StepLine(const CommandStep& step) {
  std::string text = "  " + UtcMillisecondText(step.utime) + "  " + Left(StateName(step.state), kOutcome) + ' ';
  if (step.progress > 0 && step.state == S::STATE_RUNNING) text += Decimal(100 * step.progress, 0) + " %, ";
  text += CauseText(step.state, step.verified, step.finding, step.reason_code, step.text);
  text.erase(text.find_last_not_of(" ,") + 1);
  return text + '\n';
}

std::string ChangeLines(const std::vector<change_t>& changes) {
  std::string text;
  for (const change_t& change : changes) {
    text += "  " + Shown(change.key) + ": ";
    if (!change.before.empty()) text += Shown(change.before) + " -> ";
    text += (change.after.empty() ? "?" : Shown(change.after)) + '\n';
  }
  return text;
}

Json StepJson(const CommandStep& step) {
  return {{"utime", step.utime},
          {"state", StateName(step.state)},
          {"verified", step.verified},
          {"found", FindingName(step.finding)},
          {"reason", ReasonName(step.reason_code)},
          {"text", step.text},
          {"progress", Field(static_cast<double>(step.progress))},
          {"changes", Field(step.changes)}};
}

std::string DatumLine(const DatumRecord& datum) {
  return std::to_string(datum.number) + ": " + (datum.value.empty() ? "" : "read " + Shown(datum.value) + ", ") +
         "counts " + std::to_string(datum.counts) + " are 0, set " + UtcText(datum.utime) + " UTC by " +
         Shown(datum.who) + ", command " + ShortId(datum.command) +
         (datum.reason.empty() ? "" : ": " + Shown(datum.reason));
}

std::string WearLine(const AxisRecord& axis, std::int64_t write_budget) {
  std::string text = std::to_string(axis.writes) + (axis.writes == 1 ? " write" : " writes");
  if (axis.since_utime != 0) text += " since " + UtcText(axis.since_utime) + " UTC";
  if (write_budget > 0) {
    const double share = 100.0 * static_cast<double>(axis.writes) / static_cast<double>(write_budget);
    text += ", " + Decimal(share, 2) + " % of " + std::to_string(write_budget);
  }
  return text;
}

Json ToJson(const DatumRecord& datum) {
  return {{"number", datum.number},
          {"counts", datum.counts},
          {"utime", datum.utime},
          {"value", datum.value},
          {"identity", datum.identity},
          {"who", datum.who},
          {"command", datum.command == CommandId{} ? Json() : Json(IdText(datum.command))},
          {"reason", datum.reason}};
}

std::string StateText(const DatumHistory& entry) {
  if (entry.datum.voided_utime != 0) {
    return "void since " + UtcText(entry.datum.voided_utime) + ": " + Shown(entry.datum.void_reason);
  }
  return entry.in_force ? "in force" : "replaced";
}

std::string DatumRow(const std::string& number, const std::string& time, const std::string& value,
                     const std::string& counts, const std::string& who, const std::string& id,
                     const std::string& rest) {
  return Right(number, 6) + ' ' + Left(time, 19) + ' ' + Right(value, 16) + ' ' + Right(counts, 14) + ' ' +
         Left(who, 10) + ' ' + Left(id, 8) + ' ' + rest + '\n';
}

}  // namespace

std::string HistoryHeading() { return Row("time (UTC)", "id", "who", "device", "operation", "outcome", "text"); }

std::string HistoryLine(const CommandRow& command) {
  const CommandRecord& record = command.record;
  return Row(UtcText(record.utime), ShortId(IdOf(record.status.id)), Printable(record.who),
             Printable(record.status.device), Printable(OperationText(record)), StateName(record.status.state),
             CauseText(record.status));
}

std::string HistoryLine(const AxisEvent& event) {
  return Row(UtcText(event.utime), "-", "-", event.device.empty() ? "-" : Printable(event.device),
             Printable(event.kind), "event", Shown(event.text));
}

std::string CommandText(const CommandRow& command, const std::vector<CommandStep>& steps) {
  const CommandRecord& record = command.record;
  const S& status = record.status;
  const std::string key = IdField(record.key_id).get<std::string>();
  const std::string cause = CauseText(status);
  std::string text = "id        " + IdText(IdOf(status.id)) + "\ncommand   " + Shown(status.device) + ' ' +
                     OperationText(record) + "\nwho       " + Shown(record.who) +
                     (record.key_id != 0 ? " (key " + key + ")" : "") + '\n';
  if (!record.reason.empty()) text += "reason    " + Shown(record.reason) + '\n';
  text += "accepted  " + UtcMillisecondText(record.utime) + " UTC, to begin until " +
          UtcMillisecondText(record.begin_by_utime) + "\noutcome   " + (status.is_final != 0 ? "" : "none yet, ") +
          std::string(StateName(status.state)) + (cause.empty() ? "" : ", " + cause) + '\n';
  if (!status.changes.empty()) text += "changes\n" + ChangeLines(status.changes);
  text += "steps\n";
  for (const CommandStep& step : steps) text += StepLine(step);
  return text;
}

Json HistoryJson(const CommandRow& command) {
  const CommandRecord& record = command.record;
  const S& status = record.status;
  return {{"kind", "command"},
          {"id", IdText(IdOf(status.id))},
          {"accepted_utime", record.utime},
          {"begin_by_utime", record.begin_by_utime},
          {"who", record.who},
          {"key_id", IdField(record.key_id)},
          {"is_unsigned", status.is_unsigned},
          {"device", status.device},
          {"operation", status.operation},
          {"arguments", Field(record.arguments)},
          {"client_reason", record.reason},
          {"outcome", StateName(status.state)},
          {"is_final", status.is_final},
          {"verified", status.verified},
          {"found", FindingName(status.finding)},
          {"reason", ReasonName(status.reason_code)},
          {"reason_code", status.reason_code},
          {"text", status.text},
          {"progress", Field(static_cast<double>(status.progress))},
          {"started_utime", status.started_utime},
          {"finished_utime", status.finished_utime},
          {"epoch_after", status.epoch_after},
          {"bridge_boot_id", IdField(record.bridge_boot_id)},
          {"driver_boot_id", IdField(status.driver_boot_id)},
          {"changes", Field(status.changes)}};
}

Json HistoryJson(const AxisEvent& event) {
  return {{"kind", "event"},
          {"utime", event.utime},
          {"device", event.device},
          {"event", event.kind},
          {"text", event.text}};
}

Json CommandJson(const CommandRow& command, const std::vector<CommandStep>& steps) {
  Json json = HistoryJson(command);
  json["steps"] = Json::array();
  for (const CommandStep& step : steps) json["steps"].push_back(StepJson(step));
  return json;
}

std::int64_t WriteBudget(const MachineConfig& machine, std::string_view device) {
  const BusConfig* bus = machine.BusOf(device);
  if (bus == nullptr) return 0;
  const auto found =
      std::ranges::find_if(bus->devices, [device](const DeviceConfig& config) { return config.name == device; });
  return found == bus->devices.end() || !found->settings ? 0 : found->settings->write_budget;
}

std::string DatumText(const DeviceRecord& device, std::int64_t write_budget) {
  const AxisRecord& axis = device.axis;
  std::string text = Shown(device.device) + "\n  datum      " + (axis.datum ? DatumLine(*axis.datum) : "none") +
                     "\n  reference  " + (axis.reference_lost ? "LOST" : "not lost") + "\n  position   ";
  text += axis.position ? "counts " + std::to_string(axis.position->counts) + " at " +
                              UtcText(axis.position->utime) + " UTC, before the datum"
                        : "unknown";
  text += "\n  wear       " + WearLine(axis, write_budget) + '\n';
  if (!axis.identity.empty()) text += "  encoder    " + Shown(axis.identity) + '\n';
  return text;
}

Json DatumJson(const DeviceRecord& device, std::int64_t write_budget) {
  const AxisRecord& axis = device.axis;
  Json position;
  if (axis.position) position = {{"counts", axis.position->counts}, {"utime", axis.position->utime}};
  return {{"device", device.device},
          {"identity", axis.identity},
          {"datum", axis.datum ? ToJson(*axis.datum) : Json()},
          {"reference_lost", axis.reference_lost},
          {"position", position},
          {"writes", axis.writes},
          {"since_utime", axis.since_utime == 0 ? Json() : Json(axis.since_utime)},
          {"write_budget", write_budget == 0 ? Json() : Json(write_budget)}};
}

std::string DatumHistoryHeading() {
  return DatumRow("number", "set (UTC)", "reading", "counts of 0", "who", "command", "state");
}

std::string DatumHistoryLine(const DatumHistory& entry) {
  const DatumRecord& datum = entry.datum;
  return DatumRow(std::to_string(datum.number), UtcText(datum.utime), Printable(datum.value),
                  std::to_string(datum.counts), Printable(datum.who), ShortId(datum.command),
                  StateText(entry) + (datum.reason.empty() ? "" : " (" + Shown(datum.reason) + ")"));
}

Json DatumHistoryJson(const std::string& device, const DatumHistory& entry) {
  Json json = {{"device", device}};
  json.update(ToJson(entry.datum));
  json["in_force"] = entry.in_force;
  const bool is_void = entry.datum.voided_utime != 0;
  json["voided_utime"] = is_void ? Json(entry.datum.voided_utime) : Json();
  json["voided_why"] = is_void ? Json(entry.datum.void_reason) : Json();
  return json;
}

}  // namespace axlecast
