#include "tools/axlecast/command/history_text.h"

#include <string_view>

#include "core/base/text.h"
#include "core/command/command_id.h"
#include "core/messages/enum_names.h"
#include "core/messages/json/field.h"
#include "core/messages/json/message_json.h"
#include "tools/axlecast/common/utc_text.h"

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

}  // namespace

std::string ShortId(const CommandId& id) { return id == CommandId{} ? "-" : IdText(id).substr(0, kId); }

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
  const std::string key = BootIdField(record.key_id).get<std::string>();
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
          {"key_id", BootIdField(record.key_id)},
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
          {"bridge_boot_id", BootIdField(record.bridge_boot_id)},
          {"driver_boot_id", BootIdField(status.driver_boot_id)},
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

}  // namespace axlecast
