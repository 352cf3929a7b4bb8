#include "tools/axlecast/command/command_run.h"

#include <cstdlib>
#include <iostream>
#include <optional>

#include "client/command/signed_messages.h"
#include "core/base/result.h"
#include "core/base/text.h"
#include "core/command/commands.h"
#include "core/messages/enum_names.h"
#include "core/messages/json/field.h"
#include "core/messages/json/message_json.h"
#include "platform/os/new_file.h"
#include "platform/os/secret_file.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/command/command_request.h"
#include "tools/axlecast/command/memory_cells.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/live/format_device.h"
#include "tools/monitor/live_machine.h"

namespace axlecast {
namespace {

constexpr std::int64_t kWaitMs = 60'000;     // the longest operation reads or writes a whole EEPROM
constexpr std::int64_t kCancelCheckMs = 50;  // interval at which Ctrl-C is checked

void PrintProgress(const command_status_t& status) {
  if (status.is_final != 0 || status.text.empty()) return;
  std::cerr << Right(Decimal(100.0 * status.progress, 0), 3) << " % " << Printable(status.text) << '\n';
}

// On a full bus, each monitor is read every few seconds.
MonoNs PresentValueTimeout(const Family& family) { return family.has_position ? 1500 * kMillisecond : 6 * kSecond; }

// Shows the present value and asks. If the operator agrees, binds the request to the epoch that was shown. Else returns
// the exit code.
std::optional<int> Ask(const MachineConfig& machine, const FoundOperation& found, CommandRequest& request) {
  const OperationSpec& operation = *found.operation;
  if (!CanAsk(operation.name)) return kExitUsage;
  const SystemClock clock;
  const auto known = [&request](const MachineView& view) {
    const DeviceView& device = *view.FindDevice(request.device);
    return (device.valid || device.motor) && device.info;
  };
  const auto view = Observe(machine, clock, PresentValueTimeout(*found.bus->family), known);
  if (!view) return Fail(view.error().text, kExitBad);
  const DeviceView& device = *view->FindDevice(request.device);
  std::cerr << PresentText(device, clock.Now()) << '\n' << operation.name << ": " << operation.help << '\n';
  if (!Confirmed()) return kExitRejected;
  if (request.expect_epoch < 0 && device.valid) request.expect_epoch = device.valid->datum_epoch;
  return std::nullopt;
}

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

// Returns true if nothing was done. `temporary` then states whether a retry can succeed.
bool WasRefused(const CommandResult& result) {
  const CommandOutcome outcome = result.outcome();
  return outcome == CommandOutcome::kRejected || outcome == CommandOutcome::kExpired ||
         outcome == CommandOutcome::kNotAccepted;
}

// Makes text from the network safe for a terminal.
std::string Shown(const std::string& text) { return CappedText(text, text.size()); }

}  // namespace

ClientSettings OperatorSettings(const MachineConfig& machine, const std::string& key_file,
                                std::optional<Role> role) {
  ClientSettings settings = SettingsOf(machine);
  const char* const environment = std::getenv("AXLECAST_KEY");
  settings.key_file = key_file.empty() && environment != nullptr ? environment : key_file;
  if (!settings.key_file.empty()) return settings;
  SecretFiles secrets;
  if (const KeyGrant* grant = ReadableKey(machine, role, secrets)) {
    settings.key_file = grant->place.file;
    settings.key_credential = grant->place.credential;
  }
  return settings;
}

OperatorClient::OperatorClient(const MachineConfig& machine, const std::string& key_file, bool show_progress)
    : client_(OperatorSettings(machine, key_file)) {
  if (show_progress) client_.OnStatus(PrintProgress);
}

CommandResult OperatorClient::Execute(const CommandRequest& request) {
  const SystemClock clock;
  const MonoNs give_up = clock.Now() + (kWaitMs + request.valid_ms) * kMillisecond;
  const CommandId id = client_.Send(request);
  while (true) {
    if (CancelOnSignal::requested()) client_.Cancel(id);
    CommandResult result = client_.Await(id, kCancelCheckMs);
    if (!result.under_way || clock.Now() >= give_up) return result;
  }
}

CommandResult OperatorClient::Query(const CommandId& id) { return client_.Query(id, kWaitMs); }

int RunCommand(const MachineConfig& machine, const CommandOptions& options) {
  const auto found = FindOperation(machine, options.device, options.operation);
  if (!found) return Fail(found.error().text, kExitUsage);
  CommandRequest request{.device = options.device,
                         .operation = options.operation,
                         .valid_ms = options.valid_ms,
                         .expect_epoch = options.epoch,
                         .reason = options.reason,
                         .prepare = options.prepare};
  if (const auto set = SetArguments(*found->operation, options.arguments, request); !set) {
    return Fail(set.error().text, kExitUsage);
  }
  if (!options.commit.empty()) request.token = ParseId(options.commit);
  const bool confirmed = options.yes || options.prepare || request.token;
  if ((found->operation->destructive || options.asks) && !confirmed) {
    if (const auto refused = Ask(machine, *found, request)) return *refused;
  }
  OperatorClient client(machine, options.key, !options.json);
  if (!client.problem().empty()) return Fail(client.problem(), kExitBad);
  const CommandResult result = client.Execute(request);
  Show(ToJson(result), ToText(result), options.json);
  const int exit_code = ExitCode(result);
  if (options.out.empty() || (exit_code != kExitDone && exit_code != kExitUnverifiable)) return exit_code;
  const std::string problem = ErrorText(WriteOutput(options.out, MemoryFileText(result)));
  return problem.empty() ? exit_code : Fail(problem, kExitBad);
}

int RunQuery(const MachineConfig& machine, const CommandId& id, bool json) {
  OperatorClient client(machine, "", !json);
  if (!client.problem().empty()) return Fail(client.problem(), kExitBad);
  const CommandResult result = client.Query(id);
  Show(ToJson(result), ToText(result), json);
  return ExitCode(result);
}

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
