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
#include "tools/axlecast/command/command_options.h"
#include "tools/axlecast/command/command_report.h"
#include "tools/axlecast/common/confirmation.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/screen.h"
#include "tools/axlecast/device_data/device_backup.h"
#include "tools/axlecast/device_data/restore_run.h"
#include "tools/axlecast/live/status_text.h"
#include "tools/monitor/live_machine.h"

namespace axlecast {
namespace {

constexpr MonoNs kLook = 6 * kSecond;  // DEVICE and ALARM come once a second; on a busy machine later

struct Options {
  ConfigOption config;
  RestoreWish wish;  // of `backup`: its command, and the file to write
  std::string program;
};

int Wrong(const std::string& problem, int exit_code) {
  std::cerr << problem << '\n';
  return exit_code;
}

// The machine's messages, as soon as the device's DEVICE and ALARM have come. Nothing: the exit code says why.
std::optional<MachineView> Look(const MachineConfig& machine, const std::string& name, int& exit_code) {
  const SystemClock clock;
  LiveMachine live(machine, clock);
  const auto known = [&name](const MachineView& view) {
    const DeviceView& device = *view.FindDevice(name);
    return device.info && device.alarms.heard();
  };
  if (!live.problem().empty() || !live.Gather(clock.Now() + kLook, known)) {
    exit_code = Wrong(live.problem().empty() ? "the LCM port failed" : live.problem(), kExitBad);
    return std::nullopt;
  }
  if (live.view().FindDevice(name)->info) return live.view();
  exit_code =
      Wrong(name + ": no answer; is its driver running? (axlecast driver " + machine.BusOf(name)->name + ")",
            kExitNoAnswer);
  return std::nullopt;
}

int Backup(const Options& options) {
  int exit_code = kExitDone;
  const auto machine = options.config.Load(exit_code);
  if (!machine) return exit_code;
  const CommandOptions& wish = options.wish.command;
  const BusConfig* const bus = machine->BusOf(wish.device);
  if (bus == nullptr) return Wrong(UnknownDevice(*machine, wish.device), kExitUsage);
  const auto view = Look(*machine, wish.device, exit_code);
  if (!view) return exit_code;
  BackupReading reading;
  if (BackupOperation(*bus->family) != nullptr) {
    OperatorClient client(*machine, wish.key, !wish.json);
    if (!client.problem().empty()) return Wrong(client.problem(), kExitBad);
    reading = ReadBackup(client, *bus->family, wish);
    if (ExitCode(reading.result) != kExitDone) return Wrong(ToText(reading.result), ExitCode(reading.result));
    if (!reading.problem.empty()) return Wrong(reading.problem, kExitFailed);
  }
  DeviceBackup backup = MakeBackup(*view, *view->FindDevice(wish.device), *bus->family, reading.contents);
  backup.utime = SystemClock().UtcMicroseconds();
  backup.written_by = options.program;
  const std::string file =
      options.wish.file.empty() ? BackupFileName(wish.device, backup.utime, ".json") : options.wish.file;
  const std::string problem = WriteNewFile(file, ToFileText(backup), {.mode = 0644}, false);
  if (!problem.empty()) return Wrong(problem, kExitBad);
  const nlohmann::ordered_json json = {{"device", wish.device},
                                       {"file", file},
                                       {"cells", backup.cells.size()},
                                       {"parameters", backup.parameters.size()},
                                       {"alarms", backup.alarms.size()}};
  const std::string text = wish.device + ": " + std::to_string(backup.cells.size()) + " cells and " +
                           std::to_string(backup.parameters.size()) + " parameters in " + file + '\n';
  static_cast<void>(WriteOut(wish.json ? JsonLine(json) + '\n' : text));
  return kExitDone;
}

std::optional<DeviceBackup> ReadFile(const std::string& file, int& exit_code) {
  std::ifstream stream(file, std::ios::binary);
  std::string text(kMaxBackupBytes + 1, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (!stream.is_open() || stream.bad()) {
    exit_code = Wrong("cannot read " + file, kExitBad);
    return std::nullopt;
  }
  text.resize(static_cast<std::size_t>(stream.gcount()));
  std::string problem;
  DeviceBackup backup = ParseDeviceBackup(text, problem);
  if (problem.empty()) return backup;
  exit_code = Wrong(file + ": " + problem, kExitBad);
  return std::nullopt;
}

int Restore(const Options& options) {
  int exit_code = kExitDone;
  const auto machine = options.config.Load(exit_code);
  if (!machine) return exit_code;
  const CommandOptions& wish = options.wish.command;
  if (machine->BusOf(wish.device) == nullptr) return Wrong(UnknownDevice(*machine, wish.device), kExitUsage);
  if (!wish.yes && !options.wish.dry_run && !CanAsk("restore")) return kExitUsage;
  const auto backup = ReadFile(options.wish.file, exit_code);
  if (!backup) return exit_code;
  const auto view = Look(*machine, wish.device, exit_code);
  if (!view) return exit_code;
  RestoreRun run(*machine, options.wish);
  exit_code = run.Run(*backup, *view->FindDevice(wish.device)->info);
  static_cast<void>(WriteOut(wish.json ? JsonLine(ToJson(run.report())) + '\n' : ToText(run.report())));
  return exit_code;
}

void AddBackup(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  options->program = app.version();
  CLI::App* command = app.add_subcommand(
      "backup", "Everything readable of a device in one file: memory, parameters, identity, datum, alarms");
  command->add_option("DEVICE", options->wish.command.device, "The device")->required();
  command
      ->add_option("--out", options->wish.file,
                   "The file; default DEVICE-UTC.json in this folder. Never overwritten")
      ->type_name("FILE");
  AddCommandOptions(*command, options->config, options->wish.command, false);
  command->footer(std::string("examples:\n  axlecast backup axis1\n  axlecast backup gm3 --out gm3.json --json\n") +
                  kCommandExitCodes);
  command->callback([options, &exit_code] { exit_code = Backup(*options); });
}

void AddRestore(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command =
      app.add_subcommand("restore", "Shows what differs from a backup, asks, writes that, and reads back");
  command->add_option("DEVICE", options->wish.command.device, "The device")->required();
  command->add_option("FILE", options->wish.file, "As `axlecast backup` wrote it")->required();
  command->add_flag("--dry-run", options->wish.dry_run, "Only show what would be written, and what cannot be");
  command->add_flag("--to-another-unit", options->wish.to_another_unit,
                    "The device is another one than that of the backup: same model, other identity");
  AddCommandOptions(*command, options->config, options->wish.command, true);
  command->footer(std::string("examples:\n  axlecast restore axis1 axis1-20261121T070005Z.json --dry-run\n"
                              "  axlecast restore axis1 axis1-20261121T070005Z.json --to-another-unit\n"
                              "Interrupted, it can be repeated: what was written differs no more.\n") +
                  kCommandExitCodes);
  command->callback([options, &exit_code] { exit_code = Restore(*options); });
}

}  // namespace

void AddBackupCommands(CLI::App& app, int& exit_code) {
  AddBackup(app, exit_code);
  AddRestore(app, exit_code);
}

}  // namespace axlecast
