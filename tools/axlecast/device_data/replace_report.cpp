#include "tools/axlecast/device_data/replace_report.h"

#include "core/base/text.h"
#include "tools/axlecast/command/command_run.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

std::string Row(std::string_view name, const std::string& value) {
  return "  " + Left(name, 10) + ' ' + value + '\n';
}

bool MayBeDone(const CommandResult& result) {
  const CommandOutcome outcome = result.outcome();
  return outcome == CommandOutcome::kFailed || outcome == CommandOutcome::kIndeterminate ||
         outcome == CommandOutcome::kUnknown;
}

// Returns the state after it stopped.
const char* StoppedText(const ReplaceReport& report) {
  const bool doubt = (report.accepted && MayBeDone(*report.accepted)) ||
                     (!report.written.empty() && MayBeDone(report.written.back())) ||
                     (report.datum && MayBeDone(*report.datum));
  if (doubt) return "the last command may have been done, or in part: check the device before you continue";
  switch (*report.stopped) {
    case ReplaceStep::kBackup:
    case ReplaceStep::kExchange:
      return "nothing was changed in the device, nor in what the bridge keeps of it";
    case ReplaceStep::kAccept:
      return "the bridge still counts the wear of the old one, and keeps its datum";
    case ReplaceStep::kWriteBack:
      return "the new one holds what is listed here; the rest of the backup was not written, no datum was set";
    case ReplaceStep::kDatum:
      return "no datum was set: readings are not REFERENCED";
  }
  return "";
}

std::string Ended(const CommandResult& result) {
  std::string text = ToText(result);
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text;
}

bool IsDone(const std::optional<CommandResult>& result) {
  return result &&
         (result->outcome() == CommandOutcome::kDone || result->outcome() == CommandOutcome::kDoneUnverified);
}

std::string Addresses(const std::vector<std::size_t>& addresses) {
  std::string text;
  for (const std::size_t address : addresses) text += (text.empty() ? "" : " ") + std::to_string(address);
  return text;
}

}  // namespace

Json ToJson(const ReplaceReport& report) {
  Json written = Json::array();
  for (const CommandResult& result : report.written) written.push_back(ToJson(result));
  const std::string next = NextCommand(report);
  return {{"device", report.device},
          {"backup", report.backup.empty() ? Json() : Json(report.backup)},
          {"backup_problem", report.backup_problem.empty() ? Json() : Json(report.backup_problem)},
          {"encoder", report.encoder.empty() ? Json() : Json(report.encoder)},
          {"accepted", report.accepted ? ToJson(*report.accepted) : Json()},
          {"written", written},
          {"not_permitted", report.not_permitted},
          {"datum", report.datum ? ToJson(*report.datum) : Json()},
          {"stopped_at", report.stopped ? Json(kReplaceSteps[static_cast<std::size_t>(*report.stopped)]) : Json()},
          {"next", next.empty() ? Json() : Json(next)}};
}

std::string ToText(const ReplaceReport& report) {
  std::string text = report.device + '\n';
  if (!report.backup.empty()) text += Row("backup", report.backup);
  if (!report.backup_problem.empty()) text += Row("backup", "none: " + report.backup_problem);
  if (!report.encoder.empty()) text += Row("answers", report.encoder);
  if (report.accepted) text += Row("accepted", Ended(*report.accepted));
  for (const CommandResult& result : report.written) text += Row("written", Ended(result));
  if (!report.not_permitted.empty()) {
    text += Row("differs", "addresses " + Addresses(report.not_permitted) +
                               ": not written, because the machine's file does not list them");
  }
  if (report.datum) text += Row("datum", Ended(*report.datum));
  const std::string next = NextCommand(report);
  if (report.stopped) {
    const std::size_t step = static_cast<std::size_t>(*report.stopped);
    return text + "stopped at " + std::string(kReplaceSteps[step]) + ": " + StoppedText(report) +
           "; continue with\n  " + next + '\n';
  }
  return next.empty() ? text : text + "no datum was set: readings are not REFERENCED until\n  " + next + '\n';
}

std::string NextCommand(const ReplaceReport& report) {
  if (report.stopped) {
    std::string command = "axlecast replace " + report.device + " --from " +
                          std::string(kReplaceSteps[static_cast<std::size_t>(*report.stopped)]);
    return report.backup.empty() ? command : command + " --backup " + report.backup;
  }
  if (!report.has_position || IsDone(report.datum)) return "";
  return "axlecast home " + report.device + " --value V";
}

}  // namespace axlecast
