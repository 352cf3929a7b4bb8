#include "tools/axlecast/device_data/replace_report.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <axlecast/device_info_t.hpp>
#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>
#include <utility>

#include "bridge/store/history.h"
#include "core/base/result.h"
#include "core/base/text.h"
#include "core/config/machine_config.h"
#include "core/messages/enum_names.h"
#include "core/messages/json/field.h"
#include "platform/os/new_file.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/command/command_run.h"
#include "tools/axlecast/command/format_journal.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/subcommands.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/device_data/device_access.h"
#include "tools/axlecast/live/format_device.h"
#include "tools/monitor/live_machine.h"

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

std::string Addresses(const std::vector<std::size_t>& addresses) {
  std::string text;
  for (const std::size_t address : addresses) text += (text.empty() ? "" : " ") + std::to_string(address);
  return text;
}

constexpr MonoNs kTimeout = 6 * kSecond;  // DEVICE is published once per second, on a busy machine later

// Returns true if the device is online or degraded and its DEVICE message was received.
bool Answers(const DeviceView& device, MonoNs now) {
  if (!device.info) return false;
  const auto state = device.State(now);
  return state == device_info_t::STATE_ONLINE || state == device_info_t::STATE_DEGRADED;
}

std::string StateText(const DeviceView& device, MonoNs now) {
  const auto state = device.State(now);
  if (!state) return "SILENT (no message from its driver)";
  const std::string reason = device.info ? Printable(device.info->reason) : "";
  return std::string(DeviceStateName(*state)) + (reason.empty() ? "" : " (" + reason + ")");
}

// "identity 17, serial SN0042, model ts5669n127"
std::string EncoderText(const device_info_t& info) {
  std::string text = "identity " + (info.identity < 0 ? std::string("unknown") : std::to_string(info.identity));
  if (!info.serial.empty()) text += ", serial " + Printable(info.serial);
  if (!info.firmware.empty()) text += ", firmware " + Printable(info.firmware);
  return text + ", model " + Printable(info.model);
}

void PrintAlarms(const DeviceView& device) {
  for (const alarm_entry_t& alarm : device.alarms.entries()) {
    std::cerr << "  alarm " << Printable(alarm.name) << ": " << Printable(alarm.action) << '\n';
  }
}

struct ReplaceOptions {
  ConfigOption config;
  CommandOptions command;  // device, key, validity, reason, yes
  std::string from = "backup";
  bool already_exchanged = false;
  std::string backup;  // file: read if it exists, else written; empty: a generated name
  std::string value;   // value of the axis after the exchange; empty: ask, or set no datum with `yes`
};

// Guides an operator through the exchange of a device. Each step is confirmed and can be repeated. Reports on standard
// error. The steps return an exit code; kExitDone: continue with the next step.
class ReplaceWizard {
 public:
  // The machine must contain the device.
  ReplaceWizard(const MachineConfig& machine, const ReplaceOptions& options)
      : machine_(machine),
        family_(*machine.BusOf(options.command.device)->family),
        options_(options),
        client_(machine, options_.command.key, !options_.command.json) {
    report_.device = options_.command.device;
    report_.has_position = family_.has_position;
  }

  [[nodiscard]] const ReplaceReport& report() const { return report_; }

  [[nodiscard]] int Run() {
    if (const auto ready = client_.state(); !ready) return Fail(ready.error().text, kExitBad);
    const std::string from = options_.already_exchanged ? "accept" : options_.from;
    const auto first = std::find(std::begin(kReplaceSteps), std::end(kReplaceSteps), from);
    from_ = static_cast<ReplaceStep>(std::distance(std::begin(kReplaceSteps), first));
    ShowKnown();
    report_.stopped = from_;
    if (const int exit_code = LoadBackup(); exit_code != kExitDone) return exit_code;
    const std::pair<ReplaceStep, int (ReplaceWizard::*)()> steps[] = {
        {ReplaceStep::kBackup, &ReplaceWizard::Backup},
        {ReplaceStep::kExchange, &ReplaceWizard::Exchange},
        {ReplaceStep::kAccept, &ReplaceWizard::Accept},
        {ReplaceStep::kWriteBack, &ReplaceWizard::WriteBack},
        {ReplaceStep::kDatum, &ReplaceWizard::SetDatum}};
    for (const auto& [step, run] : steps) {
      if (step < from_) continue;
      report_.stopped = step;
      if (CancelOnSignal::requested()) return kExitRejected;
      if (const int exit_code = (this->*run)(); exit_code != kExitDone) return exit_code;
    }
    report_.stopped.reset();
    return report_.datum ? ExitCode(*report_.datum) : kExitDone;
  }

 private:
  // Returns the device after its messages were received and, with `answers`, it answers; at most after a few seconds.
  [[nodiscard]] DeviceView Look(bool answers = false) {
    LiveMachine live(machine_, clock_);
    const std::string& name = report_.device;
    const auto known = [&](const MachineView& view) {
      const DeviceView& device = *view.FindDevice(name);
      const bool received =
          device.Received() && (device.position || !device.has_position) && device.alarms.received();
      return (received && (!answers || Answers(device, clock_.Now()))) || CancelOnSignal::requested();
    };
    if (const auto gathered = live.Gather(clock_.Now() + kTimeout, known); !gathered) {
      std::cerr << gathered.error().text << '\n';
    }
    return *live.view().FindDevice(name);
  }

  [[nodiscard]] CommandRequest Request(const char* operation) const {
    return {.device = report_.device,
            .operation = operation,
            .valid_ms = options_.command.valid_ms,
            .reason = options_.command.reason};
  }

  [[nodiscard]] bool Agreed() const { return options_.command.yes || Confirmed(); }

  // Returns kExitDone if the command was executed. Otherwise prints its outcome.
  [[nodiscard]] static int Finish(const CommandResult& result) {
    return IsDone(result) ? kExitDone : PrintOutcome(result);
  }

  void ShowKnown() {
    const DeviceView device = Look();
    const MonoNs now = clock_.Now();
    std::cerr << PresentText(device, now) << '\n'
              << "  state " << StateText(device, now) << '\n'
              << "  " << (device.info ? EncoderText(*device.info) : "its identity is unknown") << '\n';
    HistoryReader reader(JournalFile(machine_));
    const std::vector<DeviceRecord> devices = reader.Devices();
    const auto found = std::find_if(devices.begin(), devices.end(),
                                    [&](const DeviceRecord& record) { return record.device == report_.device; });
    if (found != devices.end()) std::cerr << DatumText(*found, WriteBudget(machine_, report_.device));
    if (!reader.state()) {
      std::cerr << "  datum and wear are not known here: " << reader.state().error().text << '\n';
    }
  }

  [[nodiscard]] int LoadBackup() {
    if (options_.backup.empty()) return kExitDone;
    std::ifstream stream(options_.backup, std::ios::binary);
    if (!stream.is_open()) {
      if (from_ == ReplaceStep::kBackup) return kExitDone;
      return Fail("cannot read " + options_.backup, kExitBad);
    }
    const std::string text{std::istreambuf_iterator<char>(stream), {}};
    Result<ContentsFile> file = ParseContents(family_, options_.backup, text);
    if (!file) return Fail(file.error().text, kExitBad);
    if (!file->device.empty() && file->device != report_.device) {
      std::cerr << "warning: " << options_.backup << " is a backup of " << file->device << '\n';
    }
    backup_ = std::move(file->contents);
    report_.backup = options_.backup;
    return kExitDone;
  }

  [[nodiscard]] int Backup() {
    if (backup_) {
      std::cerr << "backup: " << options_.backup << " exists, and is not changed\n";
      return kExitDone;
    }
    if (BackupOperation(family_) == nullptr) {
      report_.backup_problem = "devices of " + std::string(family_.name) + " store nothing that can be backed up";
      std::cerr << "backup: " << report_.backup_problem << '\n';
      return kExitDone;
    }
    const DeviceView device = Look();
    const MonoNs now = clock_.Now();
    if (Answers(device, now)) return ReadBackup();
    report_.backup_problem = "it does not answer, " + StateText(device, now);
    std::cerr << "backup: " << report_.backup_problem << "; continuing without a backup\n";
    return kExitDone;
  }

  [[nodiscard]] int ReadBackup() {
    BackupReading reading = ReadContents(client_, family_, options_.command);
    if (const int exit_code = CheckReading(reading, "backup: "); exit_code != kExitDone) return exit_code;
    const std::string file = options_.backup.empty()
                                 ? BackupFileName(report_.device, clock_.UtcMicroseconds(), ".txt")
                                 : options_.backup;
    if (const Result<> done = WriteOutput(file, reading.text); !done) {
      return Fail(done.error().text, kExitBad);
    }
    backup_ = *std::move(reading.contents);
    report_.backup = file;
    std::cerr << "backup: written to " << file << '\n';
    return kExitDone;
  }

  [[nodiscard]] int Exchange() {
    LiveMachine live(machine_, clock_);
    const auto known = [this](const MachineView& view) {
      return view.FindDevice(report_.device)->info || CancelOnSignal::requested();
    };
    Result<> gathered = live.Gather(clock_.Now() + kTimeout, known);
    std::cerr << "Exchange " << report_.device
              << " now. This waits until it was away and answers again; Ctrl-C stops.\n";
    ExchangeWatch watch;
    std::string reported;
    const auto back = [&](const MachineView& view) {
      const MonoNs now = clock_.Now();
      const DeviceView& device = *view.FindDevice(report_.device);
      watch.On(device.State(now), device.info ? device.info->boot_id : 0, now);
      const std::string state = StateText(device, now);
      if (state != std::exchange(reported, state)) std::cerr << "  " << report_.device << ": " << state << '\n';
      return watch.stage() == ExchangeWatch::Stage::kBack || CancelOnSignal::requested();
    };
    if (gathered) gathered = live.Gather(kNever, back);
    if (!gathered) return Fail(gathered.error().text, kExitBad);
    return watch.stage() == ExchangeWatch::Stage::kBack ? kExitDone : kExitRejected;
  }

  [[nodiscard]] int Accept() {
    const DeviceView device = Look(true);  // one that was just put in may need a moment
    const MonoNs now = clock_.Now();
    if (!Answers(device, now)) {
      std::cerr << report_.device << " does not answer: " << StateText(device, now)
                << "\nIf the machine's file gives the identity of the old one: change it, restart the driver\n";
      return kExitNoAnswer;
    }
    report_.encoder = EncoderText(*device.info);
    std::cerr << "now answers: " << report_.encoder << ", " << StateText(device, now) << '\n';
    PrintAlarms(device);
    if (!family_.has_position) return kExitDone;  // a monitor has neither datum nor wear
    std::cerr << "Accept it as another encoder? Its wear, identity and datum start again.\n";
    if (!Agreed()) return kExitRejected;
    report_.accepted = client_.Execute(Request("accept_exchange"));
    return Finish(*report_.accepted);
  }

  [[nodiscard]] int WriteBack() {
    if (!backup_) {
      std::cerr << "write: there is no backup to write back\n";
      return kExitDone;
    }
    return backup_->values.empty() ? WriteCells() : WriteValues();
  }

  [[nodiscard]] int WriteCells() {
    const BackupReading present = ReadContents(client_, family_, options_.command);
    if (const int exit_code = CheckReading(present, "write: "); exit_code != kExitDone) return exit_code;
    const PermittedCells permitted =
        QueryPermitted(client_, options_.command, present.contents->cells, backup_->cells);
    report_.not_permitted = permitted.not_permitted;
    if (permitted.failed) return PrintOutcome(*permitted.failed);
    const std::vector<CellRun> runs = CellRuns(present.contents->cells, permitted.cells, kMaxWrite);
    if (runs.empty()) std::cerr << "write: nothing that may be written differs from the backup\n";
    for (const CellRun& run : runs) {
      if (const int exit_code = WriteRun(run); exit_code != kExitDone) return exit_code;
    }
    return kExitDone;
  }

  [[nodiscard]] int WriteRun(const CellRun& run) {
    std::cerr << "write: address " << run.address << ": " << HexText(run.before) << " -> " << HexText(run.after)
              << '\n';
    if (!Agreed()) return CancelOnSignal::requested() ? kExitRejected : kExitDone;
    report_.written.push_back(axlecast::WriteCells(client_, options_.command, run));
    return Finish(report_.written.back());
  }

  [[nodiscard]] int WriteValues() {
    const ParameterReading present = ReadParameters(client_, family_, options_.command);
    if (ExitCode(present.result) != kExitDone) return PrintOutcome(present.result);
    if (!present.values) return Fail("write: " + present.values.error().text, kExitFailed);
    const ParameterChanges changes = ParameterDiff(*present.values, backup_->values);
    std::cerr << "write: " << changes.size() << " parameters differ from the backup\n" << ToText(changes);
    if (changes.empty()) return kExitDone;
    if (!Agreed()) return CancelOnSignal::requested() ? kExitRejected : kExitDone;
    report_.written = WriteParameters(client_, options_.command, changes);
    return Finish(report_.written.back());
  }

  [[nodiscard]] std::string AskValue() const {
    for (std::string answer; !CancelOnSignal::requested();) {
      std::cerr << "What does the axis read now, in its unit? (empty: it stays without datum) ";
      if (!std::getline(std::cin, answer) || answer.empty()) return "";
      if (CLI::Number(answer).empty()) return answer;
      std::cerr << Printable(answer) << " is no number\n";
    }
    return "";
  }

  [[nodiscard]] int SetDatum() {
    if (!family_.has_position) return kExitDone;
    const std::string value = options_.value.empty() && !options_.command.yes ? AskValue() : options_.value;
    if (CancelOnSignal::requested()) return kExitRejected;
    if (value.empty()) return kExitDone;
    CommandRequest request = Request("set_datum");
    request.arguments = {{"value", value}};
    report_.datum = client_.Execute(request);
    return Finish(*report_.datum);
  }

  const MachineConfig& machine_;
  const Family& family_;
  const ReplaceOptions& options_;
  ReplaceStep from_ = ReplaceStep::kBackup;
  SystemClock clock_;
  OperatorClient client_;
  ReplaceReport report_;
  std::optional<BackupContents> backup_;
};

int Replace(const MachineConfig& machine, const ReplaceOptions& options) {
  const std::string& device = options.command.device;
  if (machine.BusOf(device) == nullptr) return Fail(UnknownDevice(machine, device), kExitUsage);
  if (!options.command.yes && !CanAsk("replace")) return kExitUsage;
  ReplaceWizard wizard(machine, options);
  const int exit_code = wizard.Run();
  Show(ToJson(wizard.report()), ToText(wizard.report()), options.command.json);
  return exit_code;
}

void AddOptions(CLI::App& command, ReplaceOptions& options) {
  command.add_option("DEVICE", options.command.device, "The device")->required();
  command
      .add_option("--backup", options.backup,
                  "File of the backup: used if it exists, else written; default DEVICE-UTC.txt in this folder")
      ->type_name("FILE");
  command.add_option("--value", options.value, "Value of the axis after the exchange, in its unit")
      ->check(PlainNumber())
      ->type_name("V");
  CLI::Option* from =
      command.add_option("--from", options.from, "Start at this step")
          ->check(CLI::IsMember(std::vector<std::string>(std::begin(kReplaceSteps), std::end(kReplaceSteps))))
          ->type_name("STEP");
  command
      .add_flag("--already-exchanged", options.already_exchanged,
                "The device was already exchanged: same as --from accept, with the file of --backup if given")
      ->excludes(from);
  options.config.AddTo(command, ConfigOption::Form::kOptionOnly);
  AddKeyOption(command, options.command.key);
  command.add_flag("--yes", options.command.yes, "Do not ask; without --value, no datum is set");
  command.add_flag("--json", options.command.json, "Print the result as one JSON object");
  AddReasonOption(command, options.command.reason);
}

}  // namespace

std::string NextCommand(const ReplaceReport& report) {
  if (report.stopped) {
    std::string command = "axlecast replace " + report.device + " --from " +
                          std::string(kReplaceSteps[static_cast<std::size_t>(*report.stopped)]);
    return report.backup.empty() ? command : command + " --backup " + report.backup;
  }
  if (!report.has_position || (report.datum && IsDone(*report.datum))) return "";
  return "axlecast home " + report.device + " --value V";
}

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

void ExchangeWatch::On(std::optional<std::int8_t> state, std::int64_t boot_id, MonoNs now) {
  // A new encoder may come with alarms of its own, such as a battery that was never connected: DEGRADED.
  const bool answers = state == device_info_t::STATE_ONLINE || state == device_info_t::STATE_DEGRADED;
  const bool restarted = boot_id != 0 && boot_id_ != 0 && boot_id != boot_id_;
  if (boot_id != 0) boot_id_ = boot_id;
  if (!answers || restarted) {
    stage_ = Stage::kAway;
    answers_since_ = kNever;
  }
  if (!answers) return;
  if (answers_since_ == kNever) answers_since_ = now;
  if (stage_ == Stage::kAway && now - answers_since_ >= kSteady) stage_ = Stage::kBack;
}

void AddReplaceCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ReplaceOptions>();
  CLI::App* command =
      app.add_subcommand("replace", "Exchange a device step by step: backup, exchange, accept, write back, datum");
  AddOptions(*command, *options);
  command->footer(
      std::string(
          "examples:\n"
          "  axlecast replace axis1\n"
          "  axlecast replace axis1 --already-exchanged --backup axis1-20261121T070005Z.txt\n"
          "  axlecast replace axis1 --from datum\n"
          "  axlecast replace axis1 --yes --value 12.5 --json\n"
          "steps: backup, exchange, accept, write, datum; each can be repeated. Ctrl-C stops and prints the\n"
          "state and the command to continue.\n") +
      kCommandExitCodes);
  RunOnMachine<ReplaceOptions>(*command, options, exit_code, &Replace);
}

}  // namespace axlecast
