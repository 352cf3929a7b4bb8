#include "drivers/runtime/command/capped_text.h"
#include "drivers/runtime/command/command_words.h"
#include "tools/axlecast/command_client.h"
#include "tools/axlecast/exit_code.h"
#include "tools/json/message_json.h"

namespace axlecast {
namespace {

using S = command_status_t;

bool HasOutcome(const CommandResult& result) { return result.answered && result.status.is_final != 0; }

std::string Upper(std::string_view word) {
  std::string text(word);
  for (char& c : text) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  return text;
}

// What the network sent, made safe for a terminal.
std::string Shown(const std::string& text) { return CappedText(text, text.size()); }

}  // namespace

int ExitCode(const CommandResult& result) {
  if (!HasOutcome(result)) return kExitNoAnswer;
  switch (result.status.state) {
    case S::STATE_SUCCEEDED:
      return result.status.verified != 0 ? kExitDone : kExitUnverifiable;
    case S::STATE_REJECTED:
    case S::STATE_EXPIRED:
    case S::STATE_CANCELLED:
      return kExitRejected;
    case S::STATE_FAILED:
      return kExitFailed;
    case S::STATE_INDETERMINATE:
      return kExitIndeterminate;
    default:
      return kExitNoAnswer;
  }
}

nlohmann::ordered_json ToJson(const CommandResult& result) {
  nlohmann::ordered_json json;
  json["outcome"] = HasOutcome(result) ? StateName(result.status.state) : "unknown";
  if (result.answered) json["reason"] = ReasonName(result.status.reason_code);
  if (result.answered && result.status.state == S::STATE_INDETERMINATE) {
    json["found"] = FindingName(result.status.finding);
  }
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
    text = Shown(status.device) + " " + Shown(status.operation) + ": " + Upper(StateName(status.state));
    if (status.state == S::STATE_SUCCEEDED) text += status.verified != 0 ? ", verified" : ", not verifiable";
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
  if (ExitCode(result) == kExitNoAnswer || ExitCode(result) == kExitIndeterminate) {
    text += "id " + IdText(result.id) + "\n";
  }
  return text;
}

}  // namespace axlecast
