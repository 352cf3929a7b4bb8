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
#include "tools/axlecast/command/command_run.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/device_data/device_access.h"
#include "tools/axlecast/device_data/parameters.h"

namespace axlecast {
namespace {

struct Options {
  ConfigOption config;
  CommandOptions command;
  std::vector<std::string> words;  // NAME or NAME=VALUE
  std::string file;
  bool no_reads = false;
};

// A device that has parameters.
struct Place {
  MachineConfig machine;
  const Family* family = nullptr;
};

std::optional<Place> Find(const Options& options, int& exit_code) {
  const auto machine = options.config.Load();
  if (!machine) {
    exit_code = options.config.Fail(machine.error());
    return std::nullopt;
  }
  const auto found = FindOperation(*machine, options.command.device, "read_parameters");
  if (found) return Place{*machine, found->bus->family};
  exit_code = Fail(found.error().text, kExitUsage);
  return std::nullopt;
}

// Returns the present values of the device, or sets the exit code.
ParameterValues Present(const Place& place, const Options& options, int& exit_code) {
  OperatorClient client(place.machine, options.command.key, false);
  const ParameterReading reading = ReadParameters(client, *place.family, options.command);
  exit_code = ExitCode(reading.result);
  if (exit_code != kExitDone) {
    Show(ToJson(reading.result), ToText(reading.result), options.command.json);
  } else if (!reading.values) {
    exit_code = Fail(reading.values.error().text, kExitFailed);
  }
  return reading.values.value_or(ParameterValues());
}

// Returns the present values of the device, or no values with a warning on standard error.
ParameterValues PresentOrNone(const Place& place, const Options& options) {
  if (options.no_reads) return {};
  OperatorClient client(place.machine, options.command.key, false);
  const ParameterReading reading = ReadParameters(client, *place.family, options.command);
  if (ExitCode(reading.result) == kExitDone && reading.values) return *reading.values;
  std::cerr << "without the present values: "
            << (reading.values ? ToText(reading.result) : reading.values.error().text + '\n');
  return {};
}

int List(const Options& options) {
  int exit_code = kExitDone;
  const auto place = Find(options, exit_code);
  if (!place) return exit_code;
  const ParameterValues values = PresentOrNone(*place, options);
  Show(ListJson(place->family->parameters, values), ListText(place->family->parameters, values),
       options.command.json);
  return kExitDone;
}

int Get(const Options& options) {
  int exit_code = kExitDone;
  const auto place = Find(options, exit_code);
  if (!place) return exit_code;
  for (const std::string& name : options.words) {
    if (FindParameter(place->family->parameters, name) == nullptr) {
      return Fail(UnknownParameter(place->family->parameters, name), kExitUsage);
    }
  }
  const ParameterValues values = Chosen(Present(*place, options, exit_code), options.words);
  if (exit_code == kExitDone) Show(ToJson(options.command.device, values), ToText(values), options.command.json);
  return exit_code;
}

int Export(const Options& options) {
  int exit_code = kExitDone;
  const auto place = Find(options, exit_code);
  if (!place) return exit_code;
  const ParameterValues values = Present(*place, options, exit_code);
  if (exit_code != kExitDone) return exit_code;
  const std::string text = ParameterFileText(*place->family, options.command.device, values);
  if (options.file.empty()) return WriteOut(text) ? kExitDone : kExitBad;
  if (const Result<> done = WriteOutput(options.file, text); !done) return Fail(done.error().text, kExitBad);
  Show({{"device", options.command.device}, {"file", options.file}, {"parameters", values.size()}},
       std::to_string(values.size()) + " parameters in " + options.file + '\n', options.command.json);
  return kExitDone;
}

// Shows the differences from `wanted`, asks, and writes them.
int Write(const Place& place, const Options& options, const ParameterValues& wanted) {
  if (!options.command.yes && !CanAsk("writing parameters")) return kExitUsage;
  int exit_code = kExitDone;
  const ParameterValues present = Present(place, options, exit_code);
  if (exit_code != kExitDone) return exit_code;
  const ParameterChanges changes = ParameterDiff(present, wanted);
  std::cerr << options.command.device << ": " << changes.size() << " of " << wanted.size() << " parameters differ\n"
            << ToText(changes);
  if (!changes.empty() && !options.command.yes && !Confirmed()) return kExitRejected;
  OperatorClient client(place.machine, options.command.key, !options.command.json);
  const std::vector<CommandResult> results = WriteParameters(client, options.command, changes);
  Show(WriteJson(options.command.device, changes, results), WriteText(options.command.device, changes, results),
       options.command.json);
  return results.empty() ? kExitDone : ExitCode(results.back());
}

int Set(const Options& options) {
  int exit_code = kExitDone;
  const auto place = Find(options, exit_code);
  if (!place) return exit_code;
  const auto wanted = FromWords(place->family->parameters, options.words);
  return wanted ? Write(*place, options, *wanted) : Fail(wanted.error().text, kExitUsage);
}

int Import(const Options& options) {
  int exit_code = kExitDone;
  const auto place = Find(options, exit_code);
  if (!place) return exit_code;
  std::ifstream stream(options.file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (!stream.is_open() || stream.bad()) return Fail("cannot read " + options.file, kExitBad);
  ConfigErrors errors(options.file);
  const ParameterValues wanted = ParseParameterFile(*place->family, text, errors);
  if (errors.empty()) return Write(*place, options, wanted);
  std::cerr << errors.Text();
  return kExitBad;
}

void AddList(CLI::App& param, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = param.add_subcommand("list", "List names, present values, units, ranges and meanings");
  command->add_option("DEVICE", options->command.device, "The device")->required();
  options->config.AddTo(*command, ConfigOption::Form::kOptionOnly);
  AddKeyOption(*command, options->command.key);
  command->add_flag("--no-reads", options->no_reads, "Omit the present values: do not read the device");
  command->add_flag("--json", options->command.json, "Print one JSON object");
  command->footer(
      "examples:\n  axlecast param list gm3\n  axlecast param list gm3 --no-reads\n"
      "A value that cannot be read is shown as -, with the reason on standard error. Exit code: 0, or 2 usage");
  command->callback([options, &exit_code] { exit_code = List(*options); });
}

// Adds a verb that accesses the device. `arguments` adds those after the device.
template <typename Arguments>
void Add(CLI::App& param, int& exit_code, const char* name, const char* help, int (*run)(const Options&), bool asks,
         const char* example, const Arguments& arguments) {
  auto options = std::make_shared<Options>();
  CLI::App* command = param.add_subcommand(name, help);
  command->add_option("DEVICE", options->command.device, "The device")->required();
  arguments(*command, *options);
  AddCommandOptions(*command, options->config, options->command, asks);
  command->footer(std::string(example) + '\n' + kCommandExitCodes);
  command->callback([options, run, &exit_code] { exit_code = run(*options); });
}

}  // namespace

void AddParamCommand(CLI::App& app, int& exit_code) {
  CLI::App* param = app.add_subcommand("param", "List, get, set, export or import the settings of a device");
  param->require_subcommand(1);
  AddList(*param, exit_code);
  Add(*param, exit_code, "get", "Read values", &Get, false,
      "examples:\n  axlecast param get gm3\n  axlecast param get gm3 log_interval start_time_1 --json",
      [](CLI::App& command, Options& options) {
        command.add_option("NAMES", options.words, "Only these parameters; default all")->type_name("NAME");
      });
  Add(*param, exit_code, "set", "Show the changes, ask, write them, and read them back", &Set, true,
      "example: axlecast param set gm3 power_upper_a_1_50hz=125.0 log_interval=0.5",
      [](CLI::App& command, Options& options) {
        command.add_option("VALUES", options.words, "The new values, in the parameters' units")
            ->type_name("NAME=VALUE")
            ->required();
      });
  Add(*param, exit_code, "export", "Write all values as YAML, to a file or standard output", &Export, false,
      "example: axlecast param export gm3 --out gm3.yaml", [](CLI::App& command, Options& options) {
        command.add_option("--out", options.file, "Write to this file")->type_name("FILE");
      });
  Add(*param, exit_code, "import", "Show the differences from a file, ask, write them, and read them back", &Import,
      true, "examples:\n  axlecast param import gm3 gm3.yaml\n  axlecast param import gm4 gm3.yaml --yes --json",
      [](CLI::App& command, Options& options) {
        command.add_option("FILE", options.file, "A file of `param export`; it may omit parameters")->required();
      });
}

}  // namespace axlecast
