#include "tools/axlecast/command/command_report.h"

#include "core/base/text.h"
#include "core/command/command_id.h"
#include "core/messages/enum_names.h"
#include "core/messages/json/message_json.h"
#include "tools/axlecast/common/exit_code.h"

namespace axlecast {
namespace {

using S = command_status_t;

std::string Upper(std::string_view word) {
  std::string text(word);
  for (char& c : text) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  return text;
}

std::string_view OutcomeWord(const CommandResult& result) {
  switch (result.outcome()) {
    case CommandOutcome::kNotAccepted:
      return "not_accepted";
    case CommandOutcome::kPrepared:
      return "prepared";
    case CommandOutcome::kUnknown:
      return "unknown";
    default:
      return StateName(result.status.state);
  }
}

// Nothing was done, and trying again may or may not help.
bool WasRefused(const CommandResult& result) {
  const CommandOutcome what = result.outcome();
  return what == CommandOutcome::kRejected || what == CommandOutcome::kExpired ||
         what == CommandOutcome::kNotAccepted;
}

// What the network sent, made safe for a terminal.
std::string Shown(const std::string& text) { return CappedText(text, text.size()); }

}  // namespace

int ExitCode(const CommandResult& result) {
  switch (result.outcome()) {
    case CommandOutcome::kDone:
    case CommandOutcome::kPrepared:
      return kExitDone;
    case CommandOutcome::kDoneUnverified:
      return kExitUnverifiable;
    case CommandOutcome::kRejected:
    case CommandOutcome::kExpired:
    case CommandOutcome::kCancelled:
      return kExitRejected;
    case CommandOutcome::kFailed:
      return kExitFailed;
    case CommandOutcome::kIndeterminate:
      return kExitIndeterminate;
    case CommandOutcome::kNotAccepted:
    case CommandOutcome::kUnknown:
      return kExitNoAnswer;
  }
  return kExitNoAnswer;
}

nlohmann::ordered_json ToJson(const CommandResult& result) {
  nlohmann::ordered_json json;
  json["outcome"] = OutcomeWord(result);
  if (result.answered) json["reason"] = result.reason();
  if (WasRefused(result)) json["temporary"] = result.temporary();
  if (result.outcome() == CommandOutcome::kIndeterminate) json["found"] = FindingName(result.status.finding);
  if (!result.problem.empty()) json["problem"] = result.problem;
  json["id"] = IdText(result.id);
  if (result.answered) json.update(ToJson(result.status));
  json["id"] = IdText(result.id);
  return json;
}

std::string ToText(const CommandResult& result) {
  std::string text;
  if (result.answered) {
    const S& status = result.status;
    text = Shown(status.device) + " " + Shown(status.operation) + ": " +
           Upper(result.outcome() == CommandOutcome::kPrepared ? "would be done" : StateName(status.state));
    if (status.state == S::STATE_SUCCEEDED && !result.prepare)
      text += status.verified != 0 ? ", verified" : ", not verifiable";
    if (status.reason_code != S::REASON_NONE) text += " (" + std::string(ReasonName(status.reason_code)) + ")";
    if (!status.text.empty()) text += ": " + Shown(status.text);
    text += "\n";
    for (const change_t& change : status.changes) {
      text += "  " + Shown(change.key) + ": ";
      if (!change.before.empty()) text += Shown(change.before) + " -> ";
      text += Shown(change.after) + "\n";
    }
  }
  if (!result.problem.empty()) text += result.problem + "\n";
  if (result.outcome() == CommandOutcome::kRejected) {
    text += result.temporary() ? "nothing was done; it may be accepted later as it is\n"
                               : "nothing was done; it will be refused again as it is\n";
  }
  if (result.outcome() == CommandOutcome::kPrepared) {
    text += "nothing was done yet; the same words with --commit " + IdText(result.token()) + " do it\n";
  }
  if (ExitCode(result) == kExitNoAnswer || ExitCode(result) == kExitIndeterminate) {
    text += "id " + IdText(result.id) + "\n";
  }
  return text;
}

}  // namespace axlecast
