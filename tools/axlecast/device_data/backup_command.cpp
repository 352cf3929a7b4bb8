#include "core/base/result.h"
#include "tools/axlecast/device_data/subcommands.h"

#include <CLI/CLI.hpp>
#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>
#include <optional>

#include "core/messages/json/field.h"
#include "platform/os/new_file.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/command/command_run.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/device_data/device_backup.h"
#include "tools/axlecast/device_data/restore_run.h"
#include "tools/axlecast/live/format_device.h"
#include "tools/monitor/live_machine.h"

namespace axlecast {
namespace {

constexpr MonoNs kTimeout = 6 * kSecond;  // DEVICE and ALARM are published once a second, on a busy machine later

struct Options {
  ConfigOption config;
  RestoreOptions restore;  // of `backup`: its command, and the file to write
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

int Backup(const Options& options) {
  const auto machine = options.config.Load();
  if (!machine) return options.config.Fail(machine.error());
  const CommandOptions& command = options.restore.command;
  const BusConfig* const bus = machine->BusOf(command.device);
  if (bus == nullptr) return Fail(UnknownDevice(*machine, command.device), kExitUsage);
  int exit_code = kExitDone;
  const auto view = ObserveDevice(*machine, command.device, exit_code);
  if (!view) return exit_code;
  BackupReading reading;
  if (BackupOperation(*bus->family) != nullptr) {
    OperatorClient client(*machine, command.key, !command.json);
    if (const auto ready = client.state(); !ready) return Fail(ready.error().text, kExitBad);
    reading = ReadContents(client, *bus->family, command);
    if (ExitCode(reading.result) != kExitDone) return Fail(ToText(reading.result), ExitCode(reading.result));
    if (!reading.contents) return Fail(reading.contents.error().text, kExitFailed);
  }
  DeviceBackup backup = MakeBackup(*view, *view->FindDevice(command.device), *bus->family, *reading.contents);
  backup.unix_us = SystemClock().UtcMicroseconds();
  backup.written_by = options.program;
  const std::string file =
      options.restore.file.empty() ? BackupFileName(command.device, backup.unix_us, ".json") : options.restore.file;
  const std::string problem = ErrorText(WriteNewFile(file, ToFileText(backup), {.mode = 0644}, false));
  if (!problem.empty()) return Fail(problem, kExitBad);
  const nlohmann::ordered_json json = {{"device", command.device},
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

int Restore(const Options& options) {
  const auto machine = options.config.Load();
  if (!machine) return options.config.Fail(machine.error());
  const CommandOptions& command = options.restore.command;
  if (machine->BusOf(command.device) == nullptr) return Fail(UnknownDevice(*machine, command.device), kExitUsage);
  if (!command.yes && !options.restore.dry_run && !CanAsk("restore")) return kExitUsage;
  const auto backup = ReadFile(options.restore.file);
  if (!backup) return Fail(backup.error().text, kExitBad);
  int exit_code = kExitDone;
  const auto view = ObserveDevice(*machine, command.device, exit_code);
  if (!view) return exit_code;
  RestoreRun run(*machine, options.restore);
  exit_code = run.Run(*backup, *view->FindDevice(command.device)->info);
  Show(ToJson(run.report()), ToText(run.report()), command.json);
  return exit_code;
}

void AddBackup(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  options->program = app.version();
  CLI::App* command = app.add_subcommand(
      "backup", "Write everything readable of a device to one file: memory, parameters, identity, datum, alarms");
  command->add_option("DEVICE", options->restore.command.device, "The device")->required();
  command
      ->add_option("--out", options->restore.file,
                   "The file; default DEVICE-UTC.json in this folder. An existing file is never overwritten")
      ->type_name("FILE");
  AddCommandOptions(*command, options->config, options->restore.command, false);
  command->footer(std::string("examples:\n  axlecast backup axis1\n  axlecast backup gm3 --out gm3.json --json\n") +
                  kCommandExitCodes);
  command->callback([options, &exit_code] { exit_code = Backup(*options); });
}

void AddRestore(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command =
      app.add_subcommand("restore", "Show the differences from a backup, ask, write them, and read them back");
  command->add_option("DEVICE", options->restore.command.device, "The device")->required();
  command->add_option("FILE", options->restore.file, "A file of `axlecast backup`")->required();
  command->add_flag("--dry-run", options->restore.dry_run,
                    "Only show the differences, and which of them cannot be written");
  command->add_flag("--to-another-unit", options->restore.to_another_unit,
                    "Allow a device of the same model with another identity than in the backup");
  AddCommandOptions(*command, options->config, options->restore.command, true);
  command->footer(std::string("examples:\n  axlecast restore axis1 axis1-20261121T070005Z.json --dry-run\n"
                              "  axlecast restore axis1 axis1-20261121T070005Z.json --to-another-unit\n"
                              "If it was interrupted, repeat it: values that were written no longer differ.\n") +
                  kCommandExitCodes);
  command->callback([options, &exit_code] { exit_code = Restore(*options); });
}

}  // namespace

void AddBackupCommands(CLI::App& app, int& exit_code) {
  AddBackup(app, exit_code);
  AddRestore(app, exit_code);
}

}  // namespace axlecast
