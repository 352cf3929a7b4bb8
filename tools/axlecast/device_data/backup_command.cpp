#include "tools/axlecast/common/subcommands.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <fstream>
#include <iostream>
#include <memory>
#include <optional>
#include <utility>

#include "core/base/result.h"
#include "core/base/text.h"
#include "core/device/parameter.h"
#include "platform/os/new_file.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/command/command_run.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/device_data/device_access.h"
#include "tools/axlecast/live/format_device.h"
#include "tools/monitor/live_machine.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

constexpr MonoNs kTimeout = 6 * kSecond;  // DEVICE and ALARM are published once a second, on a busy machine later

struct BackupOptions {
  ConfigOption config;
  CommandOptions command;
  std::string file;
  std::string program;
};

// Returns the view of the machine with the device's DEVICE and ALARM, or sets the exit code.
std::optional<MachineView> ObserveDevice(const MachineConfig& machine, const std::string& name, int& exit_code) {
  auto view = Observe(machine, SystemClock(), kTimeout, [&name](const MachineView& seen) {
    const DeviceView& device = *seen.FindDevice(name);
    return device.info && device.alarms.received();
  });
  if (view && view->FindDevice(name)->info) return *std::move(view);
  exit_code = view ? Fail(NoAnswer(*view->FindDevice(name)), kExitNoAnswer) : Fail(view.error().text, kExitBad);
  return std::nullopt;
}

int Backup(const MachineConfig& machine, const BackupOptions& options) {
  const CommandOptions& command = options.command;
  const BusConfig* const bus = machine.BusOf(command.device);
  if (bus == nullptr) return Fail(UnknownDevice(machine, command.device), kExitUsage);
  int exit_code = kExitDone;
  const auto view = ObserveDevice(machine, command.device, exit_code);
  if (!view) return exit_code;
  BackupReading reading;
  if (BackupOperation(*bus->family) != nullptr) {
    OperatorClient client(machine, command.key, !command.json);
    if (const auto ready = client.state(); !ready) return Fail(ready.error().text, kExitBad);
    reading = ReadContents(client, *bus->family, command);
    exit_code = CheckReading(reading, "");
    if (exit_code != kExitDone) return exit_code;
  }
  DeviceBackup backup = MakeBackup(*view, *view->FindDevice(command.device), *bus->family, *reading.contents);
  backup.unix_us = SystemClock().UtcMicroseconds();
  backup.written_by = options.program;
  const std::string file =
      options.file.empty() ? BackupFileName(command.device, backup.unix_us, ".json") : options.file;
  const Result<> written = WriteNewFile(file, ToFileText(backup), {.mode = 0644}, false);
  if (!written) return Fail(written.error().text, kExitBad);
  const Json json = {{"device", command.device},
                     {"file", file},
                     {"cells", backup.cells.size()},
                     {"parameters", backup.parameters.size()},
                     {"alarms", backup.alarms.size()}};
  const std::string text = command.device + ": " + std::to_string(backup.cells.size()) + " cells and " +
                           std::to_string(backup.parameters.size()) + " parameters in " + file + '\n';
  Show(json, text, command.json);
  return kExitDone;
}

Result<DeviceBackup> ReadFile(const std::string& file) {
  std::ifstream stream(file, std::ios::binary);
  std::string text(kMaxBackupBytes + 1, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (!stream.is_open() || stream.bad()) {
    return Failure("cannot read " + file);
  }
  text.resize(static_cast<std::size_t>(stream.gcount()));
  return ParseDeviceBackup(text).map_error([&file](const Error& error) { return Error{file + ": " + error.text}; });
}

// ---- restore ----

// One difference between the device and the backup.
struct RestoreLine {
  enum class State : std::uint8_t { kPending, kDone, kFailed, kImpossible };

  std::string what;  // "eeprom 10-12", or a parameter
  std::string before;
  std::string after;
  State state = State::kPending;
  std::string text;  // why it failed or is impossible
};

struct RestoreReport {
  std::string device;
  std::string file;
  std::string other_unit;          // how its identity differs from the backup, or empty
  std::vector<RestoreLine> lines;  // the differences
  std::vector<std::string> kept;   // contents of the file that cannot be written, with the reason
  bool compared = false;           // false if the backup was refused
  bool dry_run = false;
  std::optional<bool> reads_back;  // after writing: all writable values are as in the backup
};

std::string_view StateName(RestoreLine::State state) {
  static constexpr std::array<std::string_view, 4> kNames = {"not_written", "written", "failed", "impossible"};
  return kNames.at(static_cast<std::size_t>(state));
}

std::string ValueOf(const ParameterSpec& parameter, std::uint16_t raw) {
  return ParameterText(parameter, raw) + ' ' + std::string(parameter.unit);
}

RestoreLine LineOf(const CellRun& run) {
  const std::size_t last = run.address + run.after.size() - 1;
  std::string what = "eeprom " + std::to_string(run.address);
  if (last != run.address) what += '-' + std::to_string(last);
  return {.what = std::move(what), .before = HexText(run.before), .after = HexText(run.after), .text = ""};
}

RestoreLine LineOf(const ParameterChange& change) {
  return {.what = std::string(change.parameter->name),
          .before = ValueOf(*change.parameter, change.before),
          .after = ValueOf(*change.parameter, change.after),
          .text = ""};
}

// Stores the outcome of a command in one of its lines.
void Settle(RestoreLine& line, const CommandResult& result) {
  const bool done = IsDone(result);
  line.state = done ? RestoreLine::State::kDone : RestoreLine::State::kFailed;
  if (!done) line.text = result.problem.empty() ? Printable(result.status.text) : result.problem;
}

std::string ToText(const RestoreReport& report) {
  if (!report.compared) return "";
  std::string text =
      report.device + ": " + std::to_string(report.lines.size()) + " differences from " + report.file + '\n';
  for (const RestoreLine& line : report.lines) {
    text += "  " + Left(StateName(line.state), 12) + line.what + ": " + line.before + " -> " + line.after +
            (line.text.empty() ? "" : ": " + line.text) + '\n';
  }
  for (const std::string& kept : report.kept) text += "  not written back: " + kept + '\n';
  if (report.reads_back) {
    text += *report.reads_back ? "read back: as in the backup\n" : "read back: it still differs from the backup\n";
  }
  return text;
}

Json ToJson(const RestoreReport& report) {
  Json json = {{"device", report.device},
               {"file", report.file},
               {"other_unit", report.other_unit.empty() ? Json() : Json(report.other_unit)},
               {"dry_run", report.dry_run},
               {"differences", Json::array()},
               {"not_written_back", report.kept},
               {"reads_back", report.reads_back ? Json(*report.reads_back) : Json()}};
  for (const RestoreLine& line : report.lines) {
    json["differences"].push_back({{"what", line.what},
                                   {"before", line.before},
                                   {"after", line.after},
                                   {"outcome", StateName(line.state)},
                                   {"text", line.text}});
  }
  return json;
}

struct RestoreOptions {
  ConfigOption config;
  CommandOptions command;  // device, key, validity, reason, yes
  std::string file;
  bool dry_run = false;
  bool to_another_unit = false;
};

// Restores a device from a backup: compares, shows the differences, asks, writes them and reads back. It can be repeated
// after an interruption: values that were written no longer differ. The steps return an exit code and report on standard
// error.
class RestoreRun {
 public:
  // The machine must contain the device.
  RestoreRun(const MachineConfig& machine, const RestoreOptions& options)
      : family_(*machine.BusOf(options.command.device)->family),
        options_(options),
        client_(machine, options_.command.key, !options_.command.json) {
    report_.device = options_.command.device;
    report_.file = options_.file;
    report_.dry_run = options_.dry_run;
  }

  [[nodiscard]] const RestoreReport& report() const { return report_; }

  [[nodiscard]] int Run(const DeviceBackup& backup, const device_info_t& info) {
    if (const auto ready = client_.state(); !ready) return Refuse(ready.error().text, kExitBad);
    if (const int exit_code = CheckUnit(backup, info); exit_code != kExitDone) return exit_code;
    Result<BackupContents> wanted = ContentsOf(backup, family_);
    if (!wanted) return Refuse(wanted.error().text, kExitBad);
    wanted_ = *std::move(wanted);
    ListKept(backup);
    report_.compared = BackupOperation(family_) == nullptr;
    if (report_.compared) return kExitDone;
    BackupContents present;
    if (const int exit_code = Read(present); exit_code != kExitDone) return exit_code;
    if (const int exit_code = Compare(present); exit_code != kExitDone) return exit_code;
    report_.compared = true;
    const bool pending = !runs_.empty() || !changes_.empty();
    if (!pending || options_.dry_run) return kExitDone;
    std::cerr << ToText(report_);
    if (!options_.command.yes && !Confirmed()) return kExitRejected;
    int written = WriteMemory();
    if (written == kExitDone) written = WriteValues();
    const int read_back = CancelOnSignal::requested() ? kExitRejected : ReadBack();
    return written == kExitDone ? read_back : written;
  }

 private:
  [[nodiscard]] int Refuse(const std::string& reason, int exit_code) const {
    return Fail(report_.device + ": " + reason, exit_code);
  }

  [[nodiscard]] int CheckUnit(const DeviceBackup& backup, const device_info_t& info) {
    if (backup.family != family_.name || backup.model != Printable(info.model)) {
      return Refuse("it is a " + std::string(family_.name) + ' ' + Printable(info.model) +
                        ", and the backup is of a " + Printable(backup.family) + ' ' + Printable(backup.model) +
                        ": nothing of it would fit",
                    kExitRejected);
    }
    report_.other_unit = OtherUnit(backup, info);
    if (report_.other_unit.empty()) return kExitDone;
    if (!options_.to_another_unit) {
      return Refuse("it is another unit: " + report_.other_unit + "; if that is meant: --to-another-unit",
                    kExitRejected);
    }
    return kExitDone;
  }

  void ListKept(const DeviceBackup& backup) {
    report_.kept.emplace_back("identity, serial, firmware: fixed in the device");
    if (!backup.datum.is_null()) {
      report_.kept.emplace_back("datum: it is in software, and the bridge stores it (axlecast datum show " +
                                report_.device + "); another unit needs its own: axlecast home");
    }
    if (!backup.alarms.empty())
      report_.kept.emplace_back("alarms: the device reports them, but does not store them");
    if (BackupOperation(family_) == nullptr) {
      report_.kept.emplace_back("memory, parameters: devices of " + std::string(family_.name) +
                                " keep nothing that could be read and written");
    }
  }

  // Reads the present contents of the device.
  [[nodiscard]] int Read(BackupContents& present) {
    BackupReading reading = ReadContents(client_, family_, options_.command);
    if (const int exit_code = CheckReading(reading, report_.device + ": "); exit_code != kExitDone)
      return exit_code;
    present = *std::move(reading.contents);
    return kExitDone;
  }

  [[nodiscard]] int Compare(const BackupContents& present) {
    const PermittedCells permitted = QueryPermitted(client_, options_.command, present.cells, wanted_.cells);
    if (permitted.failed) return PrintOutcome(*permitted.failed);
    runs_ = CellRuns(present.cells, permitted.cells, kMaxWrite);
    changes_ = ParameterDiff(present.values, wanted_.values);
    for (const CellRun& run : runs_) report_.lines.push_back(LineOf(run));
    for (const ParameterChange& change : changes_) report_.lines.push_back(LineOf(change));
    for (const std::size_t address : permitted.not_permitted) {
      RestoreLine line = LineOf(
          CellRun{.address = address, .before = {present.cells.at(address)}, .after = {wanted_.cells.at(address)}});
      line.state = RestoreLine::State::kImpossible;
      line.text = "the machine's file does not list the address under eeprom_writable";
      report_.lines.push_back(std::move(line));
    }
    return kExitDone;
  }

  [[nodiscard]] int WriteMemory() {
    for (std::size_t i = 0; i < runs_.size(); ++i) {
      if (CancelOnSignal::requested()) return kExitRejected;
      const CommandResult result = WriteCells(client_, options_.command, runs_[i]);
      Settle(report_.lines[i], result);
      if (!IsDone(result)) return PrintOutcome(result);
    }
    return kExitDone;
  }

  [[nodiscard]] int WriteValues() {
    std::size_t line = runs_.size();
    const std::vector<CommandRequest> requests = WriteRequests(options_.command, changes_);
    for (const CommandRequest& request : requests) {
      if (CancelOnSignal::requested()) return kExitRejected;
      const CommandResult result = client_.Execute(request);
      for (std::size_t i = 0; i < request.arguments.size(); ++i) Settle(report_.lines[line++], result);
      if (!IsDone(result)) return PrintOutcome(result);
    }
    return kExitDone;
  }

  [[nodiscard]] int ReadBack() {
    BackupContents present;
    if (const int exit_code = Read(present); exit_code != kExitDone) return exit_code;
    const std::size_t differ =
        CellRuns(present.cells, wanted_.cells, 1).size() + ParameterDiff(present.values, wanted_.values).size();
    const auto impossible = std::count_if(report_.lines.begin(), report_.lines.end(), [](const RestoreLine& line) {
      return line.state == RestoreLine::State::kImpossible;
    });
    report_.reads_back = differ == static_cast<std::size_t>(impossible);
    return *report_.reads_back ? kExitDone : kExitFailed;
  }

  const Family& family_;
  const RestoreOptions& options_;
  OperatorClient client_;
  BackupContents wanted_;
  std::vector<CellRun> runs_;  // report_.lines has one for each, before the parameters
  ParameterChanges changes_;
  RestoreReport report_;
};

int Restore(const MachineConfig& machine, const RestoreOptions& options) {
  const CommandOptions& command = options.command;
  if (machine.BusOf(command.device) == nullptr) return Fail(UnknownDevice(machine, command.device), kExitUsage);
  if (!command.yes && !options.dry_run && !CanAsk("restore")) return kExitUsage;
  const auto backup = ReadFile(options.file);
  if (!backup) return Fail(backup.error().text, kExitBad);
  int exit_code = kExitDone;
  const auto view = ObserveDevice(machine, command.device, exit_code);
  if (!view) return exit_code;
  RestoreRun run(machine, options);
  exit_code = run.Run(*backup, *view->FindDevice(command.device)->info);
  Show(ToJson(run.report()), ToText(run.report()), command.json);
  return exit_code;
}

void AddBackup(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<BackupOptions>();
  options->program = app.version();
  CLI::App* command = app.add_subcommand(
      "backup", "Write everything readable of a device to one file: memory, parameters, identity, datum, alarms");
  command->add_option("DEVICE", options->command.device, "The device")->required();
  command
      ->add_option("--out", options->file,
                   "The file; default DEVICE-UTC.json in this folder. An existing file is never overwritten")
      ->type_name("FILE");
  AddCommandOptions(*command, options->config, options->command, false);
  command->footer(std::string("examples:\n  axlecast backup axis1\n  axlecast backup gm3 --out gm3.json --json\n") +
                  kCommandExitCodes);
  RunOnMachine<BackupOptions>(*command, options, exit_code, &Backup);
}

void AddRestore(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<RestoreOptions>();
  CLI::App* command =
      app.add_subcommand("restore", "Show the differences from a backup, ask, write them, and read them back");
  command->add_option("DEVICE", options->command.device, "The device")->required();
  command->add_option("FILE", options->file, "A file of `axlecast backup`")->required();
  command->add_flag("--dry-run", options->dry_run,
                    "Only show the differences, and which of them cannot be written");
  command->add_flag("--to-another-unit", options->to_another_unit,
                    "Allow a device of the same model with another identity than in the backup");
  AddCommandOptions(*command, options->config, options->command, true);
  command->footer(std::string("examples:\n  axlecast restore axis1 axis1-20261121T070005Z.json --dry-run\n"
                              "  axlecast restore axis1 axis1-20261121T070005Z.json --to-another-unit\n"
                              "If it was interrupted, repeat it: values that were written no longer differ.\n") +
                  kCommandExitCodes);
  RunOnMachine<RestoreOptions>(*command, options, exit_code, &Restore);
}

}  // namespace

void AddBackupCommands(CLI::App& app, int& exit_code) {
  AddBackup(app, exit_code);
  AddRestore(app, exit_code);
}

}  // namespace axlecast
