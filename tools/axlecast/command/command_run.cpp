#include "tools/axlecast/command/command_run.h"

#include <algorithm>
#include <cstdlib>
#include <iostream>

#include "client/machine/machine_clients.h"
#include "core/base/spelling.h"
#include "core/base/text.h"
#include "core/command/commands.h"
#include "core/messages/enum_names.h"
#include "core/messages/json/field.h"
#include "core/messages/json/message_json.h"
#include "platform/os/new_file.h"
#include "platform/os/secret_file.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/command/memory_cells.h"
#include "tools/axlecast/live/format_device.h"
#include "tools/monitor/live_machine.h"

namespace axlecast {
namespace {

bool Has(const Family& family, std::string_view operation) {
  return std::ranges::find(family.operations, operation, &OperationSpec::name) != family.operations.end();
}

std::string DevicesWith(const MachineConfig& machine, std::string_view operation) {
  std::vector<std::string> names;
  for (const BusConfig& bus : machine.buses) {
    if (!Has(*bus.family, operation)) continue;
    for (const DeviceConfig& device : bus.devices) names.push_back(device.name);
  }
  return names.empty() ? "no device of this machine has it"
                       : "devices of this machine that have it: " + Listed(names);
}

// Returns a hint that helps more than a list of operations, or an empty text. A device without zero needs a software
// datum. An operation of other families belongs to other devices.
std::string Hint(const MachineConfig& machine, const BusConfig& bus, const std::string& device,
                 const std::string& operation) {
  const Family& family = *bus.family;
  const bool has_zero = std::ranges::any_of(
      family.operations, [](const OperationSpec& known) { return known.name.starts_with("zero"); });
  if (operation.starts_with("zero") && family.has_position && !has_zero) {
    return ": encoders of " + std::string(family.name) + " keep no zero. Set one in software: axlecast home " +
           device + " --value 0";
  }
  if (std::ranges::none_of(Families(), [&](const Family* other) { return Has(*other, operation); })) return "";
  return std::string(family.has_position ? ": it is an encoder (" : ": it is a monitor of motors (") +
         std::string(family.name) + "); " + DevicesWith(machine, operation);
}

constexpr std::int64_t kWaitMs = 60'000;     // the longest operation reads or writes a whole EEPROM
constexpr std::int64_t kCancelCheckMs = 50;  // interval at which Ctrl-C is checked

void PrintProgress(const CommandResult& result) {
  const command_status_t& status = result.status;
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

void AddCommandOptions(CLI::App& command, ConfigOption& config, CommandOptions& options, bool asks) {
  config.AddTo(command, ConfigOption::Form::kOptionOnly);
  AddKeyOption(command, options.key);
  if (asks) command.add_flag("--yes", options.yes, "Do not ask");
  command.add_flag("--json", options.json, "Print the outcome as one JSON object");
  command
      .add_option("--valid-ms", options.valid_ms, "Maximum time until the command begins, in ms; then it expires")
      ->check(CLI::Range(1, 3'600'000))
      ->type_name("MS")
      ->capture_default_str();
  command.add_option("--epoch", options.epoch, "Reject the command if the device's datum_epoch differs")
      ->check(CLI::Range(0, INT32_MAX))
      ->type_name("N");
  AddReasonOption(command, options.reason);
}

void AddReasonOption(CLI::App& command, std::string& reason) {
  command.add_option("--reason", reason, "Reason for the journal; at most 160 bytes")
      ->check(CLI::Validator([](const std::string& text) { return text.size() <= 160 ? "" : "above 160 bytes"; },
                             "TEXT"));
}

void AddKeyOption(CLI::App& command, std::string& key) {
  command
      .add_option(
          "--key", key,
          "File of the secret key that signs; default $AXLECAST_KEY, else the first readable key of the machine's "
          "file")
      ->type_name("FILE");
}

CLI::Validator PlainNumber() {
  return CLI::Validator(
      [](const std::string& text) -> std::string {
        if (CLI::Number(text).empty()) return "";
        const std::size_t digits = text.find_first_not_of("+-.0123456789");
        const std::string number = text.substr(0, digits);
        if (digits == 0 || !CLI::Number(number).empty()) return Quoted(text) + " is no number, e.g. 123.456";
        return Quoted(text) +
               " is no number: leave the unit out (it is the device's, see `axlecast info DEVICE`), " +
               "and write " + number;
      },
      "NUMBER");
}

void AddTwoStepOptions(CLI::App& command, CommandOptions& options) {
  CLI::Option* prepare = command.add_flag("--prepare", options.prepare,
                                          "Only report what would happen, and print a token for --commit");
  command
      .add_option("--commit", options.commit,
                  "Execute the command that --prepare with the same words printed this token for; does not ask")
      ->check(CLI::Validator(
          [](const std::string& text) { return ParseId(text) ? "" : "a token is 32 hex digits"; }, "TOKEN"))
      ->excludes(prepare);
}

std::vector<const OperationSpec*> OperationsOf(const BusConfig& bus) {
  std::vector<const OperationSpec*> operations;
  for (const OperationSpec& operation : bus.family->operations) operations.push_back(&operation);
  for (const OperationSpec& operation : RuntimeOperations(*bus.family)) {
    if (!operation.internal) operations.push_back(&operation);
  }
  return operations;
}

Result<FoundOperation> FindOperation(const MachineConfig& machine, const std::string& device,
                                     const std::string& operation) {
  const BusConfig* bus = machine.BusOf(device);
  if (bus == nullptr) return Failure(UnknownDevice(machine, device));
  std::vector<std::string> names;
  for (const OperationSpec* candidate : OperationsOf(*bus)) {
    if (candidate->name == operation) return FoundOperation{bus, candidate};
    names.emplace_back(candidate->name);
  }
  const std::string text = device + " has no operation " + Quoted(operation);
  if (const std::string hint = Hint(machine, *bus, device, operation); !hint.empty()) {
    return Failure(text + hint);
  }
  const std::optional<std::string> nearest = NearestWord(operation, names);
  return Failure(text + (nearest ? "; did you mean " + *nearest + '?' : "") + "\noperations: " + Listed(names));
}

Result<> SetArguments(const OperationSpec& operation, const std::vector<std::string>& words,
                      CommandRequest& request) {
  std::vector<argument_t> arguments(words.size());
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::size_t equals = words[i].find('=');
    if (equals == std::string::npos || equals == 0) return Failure(Quoted(words[i]) + " is no key=value");
    arguments[i].key = words[i].substr(0, equals);
    arguments[i].value = words[i].substr(equals + 1);
    request.arguments.emplace_back(arguments[i].key, arguments[i].value);
  }
  return CheckArguments(operation, arguments);
}

std::string OperationList(const BusConfig& bus) {
  std::string text;
  for (const OperationSpec* operation : OperationsOf(bus)) {
    text += std::string(operation->name) + (operation->destructive ? "  (destructive: asks first)" : "") +
            "\n    " + std::string(operation->help) + '\n';
    for (const ArgumentSpec& argument : operation->arguments) {
      text += "    " + std::string(argument.name) + "=  " + std::string(argument.help) +
              (argument.required ? "" : " (optional)") + '\n';
    }
    if (!operation->verification.empty()) text += "    verified by: " + std::string(operation->verification) + '\n';
  }
  return text;
}

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

Result<> OperatorClient::state() const { return client_.state(); }

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
  if (const auto ready = client.state(); !ready) return Fail(ready.error().text, kExitBad);
  const CommandResult result = client.Execute(request);
  Show(ToJson(result), ToText(result), options.json);
  const int exit_code = ExitCode(result);
  if (options.out.empty() || (exit_code != kExitDone && exit_code != kExitUnverifiable)) return exit_code;
  const auto written = WriteOutput(options.out, MemoryFileText(result));
  return written ? exit_code : Fail(written.error().text, kExitBad);
}

int RunQuery(const MachineConfig& machine, const CommandId& id, bool json) {
  OperatorClient client(machine, "", !json);
  if (const auto ready = client.state(); !ready) return Fail(ready.error().text, kExitBad);
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
