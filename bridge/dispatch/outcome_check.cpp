#include "bridge/dispatch/outcome_check.h"

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>

#include "core/base/text.h"
#include "core/command/commands.h"
#include "core/messages/enum_names.h"

namespace axlecast {
namespace {

using S = command_status_t;

// A word that would be read as the next argument.
bool IsAmbiguous(const std::string& value) {
  const std::size_t space = value.find(' ');
  return space != std::string::npos && value.find('=', space) != std::string::npos;
}

// "eeprom_write address=72 data=A1 05", or nothing where that would be ambiguous or too long.
std::optional<std::string> Described(const PendingCommand& command) {
  std::string text(command.operation->name);
  for (const argument_t& argument : command.arguments) {
    if (IsAmbiguous(argument.value)) return std::nullopt;
    text += " " + argument.key + "=" + argument.value;
  }
  if (text.size() > kArgumentBytes) return std::nullopt;
  return text;
}

// Handles the late outcome of a driver that had been silent. An outcome that is not verified does not prove an effect.
std::int8_t FindingOfOutcome(const command_status_t& outcome) {
  switch (outcome.state) {
    case S::STATE_SUCCEEDED:
      return outcome.verified != 0 ? S::FINDING_EFFECT_SEEN : S::FINDING_CANNOT_TELL;
    case S::STATE_REJECTED:
    case S::STATE_EXPIRED:
    case S::STATE_CANCELLED:
      return S::FINDING_NO_EFFECT_SEEN;
    default:
      return S::FINDING_CANNOT_TELL;
  }
}

std::int8_t FindingOfChanges(const command_status_t& found) {
  if (found.state != S::STATE_SUCCEEDED) return S::FINDING_CANNOT_TELL;
  const auto word = std::find_if(found.changes.begin(), found.changes.end(),
                                 [](const change_t& change) { return change.key == "finding"; });
  return word == found.changes.end() ? S::FINDING_CANNOT_TELL : FindingOf(word->after);
}

// How what was found compares with what the lost driver had reported from before.
enum class Comparison : std::uint8_t {
  kNothing,  // there is nothing to compare
  kUnknown,  // nothing is known from before
  kSame,     // all that is known reads as before
  kDiffers,
};

// Replaces `changes`, as the lost driver had reported them, by what was found, each with its value before where
// that is known.
Comparison SetBeside(const std::vector<change_t>& found, std::vector<change_t>& changes) {
  const std::vector<change_t> reported = std::exchange(changes, {});
  const auto judged = std::find_if(reported.begin(), reported.end(),
                                   [](const change_t& one) { return one.key == "finding" && !one.before.empty(); });
  bool compared = false;
  bool differs = false;
  for (change_t change : found) {
    if (change.key == "finding") continue;  // is in the status itself
    const auto earlier =
        std::find_if(reported.begin(), reported.end(), [&](const change_t& one) { return one.key == change.key; });
    if (earlier != reported.end() && !earlier->before.empty()) {
      change.before = earlier->before;
      compared = true;
      differs = differs || change.before != change.after;
    }
    changes.push_back(change);
  }
  // The lost driver knew its device's tolerances: its own judgement of before decides.
  if (judged != reported.end()) {
    return FindingOf(judged->before) == S::FINDING_EFFECT_SEEN ? Comparison::kSame : Comparison::kDiffers;
  }
  if (changes.empty()) return Comparison::kNothing;
  if (!compared) return Comparison::kUnknown;
  return differs ? Comparison::kDiffers : Comparison::kSame;
}

}  // namespace

std::optional<PendingCommand> OutcomeCheckFor(const PendingCommand& command, const Family& family, MonoNs give_up) {
  const bool silent = command.status.reason_code == S::REASON_DRIVER_SILENT;
  const std::string_view finder = command.operation->verified_by_operation;
  const OperationSpec* operation = finder.empty() ? nullptr : FindOperation(family, finder);
  if (operation == nullptr && !silent) return std::nullopt;

  PendingCommand check;
  check.purpose = PendingCommand::Purpose::kOutcomeCheck;
  check.device = command.device;
  check.operation = operation;
  check.begin_by = give_up;
  check.who = command.who;
  check.reason = command.reason;
  check.about = command.id;
  check.about_operation = command.operation;
  check.about_arguments = command.arguments;
  check.about_boot_id = command.status.driver_boot_id;
  check.about_epoch = command.sent_epoch;
  check.about_silent = silent;
  const auto described = Described(command);
  if (operation != nullptr && described) {
    const auto& takes = operation->arguments;
    if (std::any_of(takes.begin(), takes.end(), [](const ArgumentSpec& spec) { return spec.name == "after"; })) {
      check.arguments.push_back({"after", *described});
    }
  }
  return check;
}

std::optional<PendingCommand> NextOutcomeCheck(const PendingCommand& finding, MonoNs now) {
  const command_status_t& found = finding.status;
  const bool unread = found.state == S::STATE_FAILED && found.reason_code == S::REASON_NO_REPLY;
  const bool refused = found.state == S::STATE_REJECTED && IsTemporary(found.reason_code);
  const bool looked = !finding.queries_driver && finding.operation != nullptr;
  if (!looked || !(unread || refused) || now + kCheckAgain >= finding.begin_by) return std::nullopt;
  PendingCommand check = finding;
  check.not_before = now + kCheckAgain;
  check.status = {};
  check.nv_writes = 0;
  return check;
}

void AddCheckedOutcome(const PendingCommand& finding, command_status_t& outcome) {
  const command_status_t& found = finding.status;
  const bool never_routed = found.driver_boot_id == 0;
  std::string details = found.text;
  if (finding.queries_driver) {
    const bool untold = found.state == S::STATE_EXPIRED && found.reason_code == S::REASON_DEADLINE;
    outcome.finding = untold ? S::FINDING_CANNOT_TELL : FindingOfOutcome(found);
    outcome.changes = found.changes;
  } else {
    outcome.finding = FindingOfChanges(found);
    const Comparison comparison = SetBeside(found.changes, outcome.changes);
    const bool same = comparison == Comparison::kSame;
    if (outcome.finding == S::FINDING_EFFECT_SEEN && (same || comparison == Comparison::kUnknown)) {
      outcome.finding = S::FINDING_CANNOT_TELL;
      details = (same ? "it read the same before; " : "what it read before is not known; ") + details;
    }
  }
  outcome.n_changes = static_cast<std::int8_t>(outcome.changes.size());
  outcome.text += never_routed ? "; the driver has not come back: look at the device"
                               : "; afterwards: " + std::string(FindingName(outcome.finding));
  if (!details.empty() && !never_routed) outcome.text += " (" + details + ")";
  outcome.text = CappedText(outcome.text, kTextBytes);
}

PendingCommand RecoveredCommand(const MachineConfig& machine, const OpenCommand& command) {
  PendingCommand pending;
  pending.status = command.record.status;
  pending.id = IdOf(pending.status.id);
  pending.device = pending.status.device;
  pending.arguments = command.record.arguments;
  pending.who = command.record.who;
  pending.reason = command.record.reason;
  if (const BusConfig* bus = machine.BusOf(pending.device)) {
    pending.operation = FindOperation(*bus->family, pending.status.operation);
  }
  return pending;
}

void GiveUp(S& status, Timestamp now) {
  const bool sent = status.driver_boot_id != 0;
  status.state = sent ? S::STATE_INDETERMINATE : S::STATE_REJECTED;
  status.finding = sent ? S::FINDING_CANNOT_TELL : S::FINDING_NONE;
  status.reason_code = S::REASON_BRIDGE_RESTARTED;
  status.text = sent ? "the bridge restarted, and the machine's file has this device or operation no more"
                     : "the bridge restarted before it was sent: nothing was done; send it again";
  status.finished_utime = now.utime;
}

}  // namespace axlecast
