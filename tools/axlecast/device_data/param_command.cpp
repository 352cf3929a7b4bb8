#include "core/base/result.h"
#include "tools/axlecast/common/subcommands.h"

#include <CLI/CLI.hpp>
#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>

#include "platform/os/new_file.h"
#include "tools/axlecast/command/command_run.h"
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

// A device that has parameters, and the options of the command.
struct Target {
  const Options& options;
  const MachineConfig& machine;
  const Family* family = nullptr;

  [[nodiscard]] const CommandOptions& command() const { return options.command; }
  [[nodiscard]] Parameters parameters() const { return family->parameters; }
  [[nodiscard]] ParameterReading Read() const {
    OperatorClient client(machine, command().key, false);
    return ReadParameters(client, *family, command());
  }
};

// Sets the callback of `command`: finds the device, and executes `run`.
void RunOnTarget(CLI::App& command, const std::shared_ptr<Options>& options, int& exit_code,
                 int (*run)(const Target& target)) {
  RunOnMachine<Options>(command, options, exit_code, [run](const MachineConfig& machine, const Options& parsed) {
    const auto found = FindOperation(machine, parsed.command.device, "read_parameters");
    return found ? run(Target{parsed, machine, found->bus->family}) : Fail(found.error().text, kExitUsage);
  });
}

// Sets the present values of the device. Returns kExitDone, or prints why they cannot be read and returns the exit code.
int ReadPresent(const Target& target, ParameterValues& present) {
  const ParameterReading reading = target.Read();
  if (const int exit_code = ExitCode(reading.result); exit_code != kExitDone) {
    Show(ToJson(reading.result), ToText(reading.result), target.command().json);
    return exit_code;
  }
  if (!reading.values) return Fail(reading.values.error().text, kExitFailed);
  present = *reading.values;
  return kExitDone;
}

int List(const Target& target) {
  ParameterValues values;
  if (!target.options.no_reads) {
    const ParameterReading reading = target.Read();
    if (ExitCode(reading.result) == kExitDone && reading.values) {
      values = *reading.values;
    } else {
      std::cerr << "without the present values: "
                << (reading.values ? ToText(reading.result) : reading.values.error().text + '\n');
    }
  }
  Show(ListJson(target.parameters(), values), ListText(target.parameters(), values), target.command().json);
  return kExitDone;
}

int Get(const Target& target) {
  for (const std::string& name : target.options.words) {
    if (FindParameter(target.parameters(), name) == nullptr) {
      return Fail(UnknownParameter(target.parameters(), name), kExitUsage);
    }
  }
  ParameterValues present;
  if (const int exit_code = ReadPresent(target, present); exit_code != kExitDone) return exit_code;
  const ParameterValues values = Chosen(present, target.options.words);
  Show(ToJson(target.command().device, values), ToText(values), target.command().json);
  return kExitDone;
}

int Export(const Target& target) {
  ParameterValues values;
  if (const int exit_code = ReadPresent(target, values); exit_code != kExitDone) return exit_code;
  const std::string& file = target.options.file;
  const std::string text = ParameterFileText(*target.family, target.command().device, values);
  if (file.empty()) return WriteOut(text) ? kExitDone : kExitBad;
  if (const Result<> done = WriteOutput(file, text); !done) return Fail(done.error().text, kExitBad);
  Show({{"device", target.command().device}, {"file", file}, {"parameters", values.size()}},
       std::to_string(values.size()) + " parameters in " + file + '\n', target.command().json);
  return kExitDone;
}

// Shows the differences from `wanted`, asks, and writes them.
int Write(const Target& target, const ParameterValues& wanted) {
  const CommandOptions& command = target.command();
  if (!command.yes && !CanAsk("writing parameters")) return kExitUsage;
  ParameterValues present;
  if (const int exit_code = ReadPresent(target, present); exit_code != kExitDone) return exit_code;
  const ParameterChanges changes = ParameterDiff(present, wanted);
  std::cerr << command.device << ": " << changes.size() << " of " << wanted.size() << " parameters differ\n"
            << ToText(changes);
  if (!changes.empty() && !command.yes && !Confirmed()) return kExitRejected;
  OperatorClient client(target.machine, command.key, !command.json);
  const std::vector<CommandResult> results = WriteParameters(client, command, changes);
  Show(WriteJson(command.device, changes, results), WriteText(command.device, changes, results), command.json);
  return results.empty() ? kExitDone : ExitCode(results.back());
}

int Set(const Target& target) {
  const auto wanted = FromWords(target.parameters(), target.options.words);
  return wanted ? Write(target, *wanted) : Fail(wanted.error().text, kExitUsage);
}

int Import(const Target& target) {
  const std::string& file = target.options.file;
  std::ifstream stream(file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (!stream.is_open() || stream.bad()) return Fail("cannot read " + file, kExitBad);
  ConfigErrors errors(file);
  const ParameterValues wanted = ParseParameterFile(*target.family, text, errors);
  if (errors.empty()) return Write(target, wanted);
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
  RunOnTarget(*command, options, exit_code, &List);
}

// Adds a verb that accesses the device. `arguments` adds those after the device.
template <typename Arguments>
void Add(CLI::App& param, int& exit_code, const char* name, const char* help, int (*run)(const Target&), bool asks,
         const char* example, const Arguments& arguments) {
  auto options = std::make_shared<Options>();
  CLI::App* command = param.add_subcommand(name, help);
  command->add_option("DEVICE", options->command.device, "The device")->required();
  arguments(*command, *options);
  AddCommandOptions(*command, options->config, options->command, asks);
  command->footer(std::string(example) + '\n' + kCommandExitCodes);
  RunOnTarget(*command, options, exit_code, run);
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
