#include "tools/axlecast/command/subcommands.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <memory>
#include <optional>
#include <utility>

#include "core/messages/json/field.h"
#include "tools/axlecast/command/datum_text.h"
#include "tools/axlecast/command/journal_option.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/screen.h"
#include "tools/axlecast/live/status_text.h"

namespace axlecast {
namespace {

struct Options {
  JournalOption journal;
  std::string device;
  bool json = false;
};

int Wrong(const std::string& problem, int exit_code) {
  std::cerr << problem << '\n';
  return exit_code;
}

// `devices` are those of the journal that were asked for; one that is only in the machine's file has done nothing yet.
int NothingKnown(const JournalOption::Place& place, const std::string& device) {
  if (device.empty()) return Wrong(place.file + " knows of no device yet", kExitDone);
  if (place.machine && place.machine->BusOf(device) == nullptr) {
    return Wrong(UnknownDevice(*place.machine, device), kExitUsage);
  }
  if (!place.machine) return Wrong(place.file + " knows of no device '" + device + "'", kExitBad);
  return Wrong(place.file + " knows nothing of " + device + " yet", kExitBad);
}

int Show(const Options& options) {
  int exit_code = kExitDone;
  const auto place = options.journal.Find(exit_code);
  if (!place) return exit_code;
  HistoryReader reader(place->file);
  std::vector<DeviceRecord> devices = reader.Devices();
  if (!reader.problem().empty()) return Wrong(reader.problem(), kExitBad);
  if (!options.device.empty()) {
    std::erase_if(devices, [&](const DeviceRecord& device) { return device.device != options.device; });
  }
  if (devices.empty()) return NothingKnown(*place, options.device);
  std::string text;
  for (const DeviceRecord& device : devices) {
    const std::int64_t budget = place->machine ? WriteBudget(*place->machine, device.device) : 0;
    text += options.json ? JsonLine(DatumJson(device, budget)) + '\n' : DatumText(device, budget);
  }
  static_cast<void>(WriteOut(text));
  return kExitDone;
}

int History(const Options& options) {
  int exit_code = kExitDone;
  const auto place = options.journal.Find(exit_code);
  if (!place) return exit_code;
  HistoryReader reader(place->file);
  const std::vector<DatumHistory> datums = reader.Datums(options.device);
  if (!reader.problem().empty()) return Wrong(reader.problem(), kExitBad);
  if (datums.empty()) {
    const auto devices = reader.Devices();
    const bool known = std::any_of(devices.begin(), devices.end(),
                                   [&](const DeviceRecord& device) { return device.device == options.device; });
    return known ? Wrong("no datum of " + options.device + " was ever set", kExitDone)
                 : NothingKnown(*place, options.device);
  }
  std::string text = options.json ? "" : DatumHistoryHeading();
  for (const DatumHistory& datum : datums) {
    text += options.json ? JsonLine(DatumHistoryJson(options.device, datum)) + '\n' : DatumHistoryLine(datum);
  }
  static_cast<void>(WriteOut(text));
  return kExitDone;
}

void AddShow(CLI::App& datum, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = datum.add_subcommand("show", "The datum in force, reference, last position and wear");
  command->add_option("DEVICE", options->device, "Only this device; else all that the journal knows");
  command->add_flag("--json", options->json, "One JSON object a line, for each device");
  options->journal.AddTo(*command);
  command->footer(
      "examples:\n"
      "  axlecast datum show\n"
      "  axlecast datum show axis1 --json | jq .datum.counts\n"
      "Exit code 1: nothing is known of the device, or the journal cannot be read; 2: no such device");
  command->callback([options, &exit_code] { exit_code = Show(*options); });
}

void AddHistory(CLI::App& datum, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = datum.add_subcommand("history", "Every datum that a device had, newest first");
  command->add_option("DEVICE", options->device, "The device")->required();
  command->add_flag("--json", options->json, "One JSON object a line, for each datum");
  options->journal.AddTo(*command);
  command->footer(
      "example: axlecast datum history axis1\n"
      "Exit code 1: nothing is known of the device, or the journal cannot be read; 2: no such device");
  command->callback([options, &exit_code] { exit_code = History(*options); });
}

}  // namespace

void AddDatumCommands(CLI::App& app, int& exit_code) {
  CLI::App* datum = app.add_subcommand("datum", "What positions count from: show, history, undo");
  datum->require_subcommand(1);
  AddShow(*datum, exit_code);
  AddHistory(*datum, exit_code);
  AddDatumUndo(*datum, exit_code);
}

}  // namespace axlecast
