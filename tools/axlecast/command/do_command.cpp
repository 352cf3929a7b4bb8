#include <CLI/CLI.hpp>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "core/alarm/alarm_table.h"
#include "core/command/commands.h"
#include "tools/axlecast/command/command_run.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/subcommands.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/live/format_device.h"

namespace axlecast {
namespace {

struct Options {
  ConfigOption config;
  CommandOptions command;
  bool list = false;
  std::string value;    // of `home`
  std::string address;  // of `eeprom`, as count and data
  std::string count;
  std::string data;
  std::string id;  // of `outcome`
  std::string alarm;
  double seconds = 0;  // of `shelve`
};

int Run(const MachineConfig& machine, const Options& options) { return RunCommand(machine, options.command); }

// A subcommand that runs one operation on a device.
struct Verb {
  const char* name;
  std::string_view operation;
  const char* summary;
  std::string footer;  // before the exit codes
  bool has_yes = true;
  bool has_two_steps = true;                                    // --prepare and --commit
  std::function<void(CLI::App&, Options&)> add_arguments = {};  // those between DEVICE and the common options
  std::function<int(const MachineConfig&, Options&)> run = &Run;
};

CLI::App* AddVerb(CLI::App& parent, int& exit_code, const Verb& verb) {
  auto options = std::make_shared<Options>();
  options->command.operation = verb.operation;
  CLI::App* command = parent.add_subcommand(verb.name, verb.summary);
  command->add_option("DEVICE", options->command.device, "The device")->required();
  if (verb.add_arguments) verb.add_arguments(*command, *options);
  AddCommandOptions(*command, options->config, options->command, verb.has_yes);
  if (verb.has_two_steps) AddTwoStepOptions(*command, options->command);
  command->footer(verb.footer + kCommandExitCodes);
  RunOnMachine<Options>(*command, options, exit_code, verb.run);
  return command;
}

int List(const MachineConfig& machine, const Options& options) {
  const BusConfig* bus = machine.BusOf(options.command.device);
  if (bus == nullptr) return Fail(UnknownDevice(machine, options.command.device), kExitUsage);
  static_cast<void>(WriteOut(OperationList(*bus)));
  return kExitDone;
}

int Do(const MachineConfig& machine, const Options& options) {
  if (options.list) return List(machine, options);
  if (!options.command.operation.empty()) return Run(machine, options);
  return Fail("which operation? axlecast do " + options.command.device + " --list shows them", kExitUsage);
}

void AddDo(CLI::App& app, int& exit_code) {
  AddVerb(app, exit_code,
          {.name = "do",
           .operation = "",
           .summary = "Run an operation on a device",
           .footer = "examples:\n"
                     "  axlecast do axis1 --list\n"
                     "  axlecast do axis1 eeprom_read address=0 count=8\n"
                     "  axlecast do axis1 zero_single_turn --yes --json\n"
                     "  axlecast do axis1 zero_single_turn --prepare\n"
                     "  axlecast do axis1 zero_single_turn --commit TOKEN\n",
           .add_arguments =
               [](CLI::App& command, Options& options) {
                 command.add_option("OPERATION", options.command.operation, "The operation, named by its effect");
                 command.add_option("ARGUMENTS", options.command.arguments, "Arguments of the operation")
                     ->type_name("KEY=VALUE");
                 command.add_flag("--list", options.list, "List the device's operations");
               },
           .run = &Do});
}

// A multi-turn encoder can only zero its single-turn position: the name of its operation states that.
int Zero(const MachineConfig& machine, Options& options) {
  const bool single_turn = FindOperation(machine, options.command.device, "zero_single_turn").has_value();
  options.command.operation = single_turn ? "zero_single_turn" : "zero";
  return RunCommand(machine, options.command);
}

// Verbs for operations of devices without further arguments.
void AddAliases(CLI::App& app, int& exit_code) {
  AddVerb(app, exit_code,
          {.name = "zero",
           .operation = "zero",
           .summary = "Set the single-turn position to zero, in the device",
           .footer = "short for: axlecast do DEVICE zero_single_turn, or zero, depending on the family\n",
           .run = &Zero});
  AddVerb(app, exit_code,
          {.name = "reset-turns",
           .operation = "reset_turns_and_errors",
           .summary = "Set the multi-turn counter to zero and clear the errors, in the device",
           .footer = "short for: axlecast do DEVICE reset_turns_and_errors\n"});
  AddVerb(app, exit_code,
          {.name = "clear-errors",
           .operation = "clear_errors",
           .summary = "Clear the device's latched errors",
           .footer = "short for: axlecast do DEVICE clear_errors\n"});
}

void AddEeprom(CLI::App& app, int& exit_code) {
  CLI::App* eeprom = app.add_subcommand("eeprom", "Read, write or back up the device's memory");
  eeprom->require_subcommand(1);
  AddVerb(*eeprom, exit_code,
          {.name = "read",
           .operation = "eeprom_read",
           .summary = "Read bytes",
           .footer = "example: axlecast eeprom read axis1 0 8\n",
           .has_yes = false,
           .add_arguments =
               [](CLI::App& command, Options& options) {
                 command.add_option("ADDRESS", options.address, "First address")->required();
                 command.add_option("COUNT", options.count, "Number of bytes");
               },
           .run =
               [](const MachineConfig& machine, Options& options) {
                 options.command.arguments = {"address=" + options.address};
                 if (!options.count.empty()) options.command.arguments.push_back("count=" + options.count);
                 return Run(machine, options);
               }});
  AddVerb(*eeprom, exit_code,
          {.name = "write",
           .operation = "eeprom_write",
           .summary = "Write bytes and read them back",
           .footer = "example: axlecast eeprom write axis1 72 \"A1 05\"\n",
           .add_arguments =
               [](CLI::App& command, Options& options) {
                 command.add_option("ADDRESS", options.address, "First address")->required();
                 command.add_option("HEX", options.data, "The bytes, e.g. \"A1 05\"")->required();
               },
           .run =
               [](const MachineConfig& machine, Options& options) {
                 options.command.arguments = {"address=" + options.address, "data=" + options.data};
                 return Run(machine, options);
               }});
  AddVerb(*eeprom, exit_code,
          {.name = "backup",
           .operation = "eeprom_backup",
           .summary = "Read the whole memory",
           .footer = "example: axlecast eeprom backup axis1 --out axis1.eeprom\n",
           .has_yes = false,
           .add_arguments = [](CLI::App& command, Options& options) {
             command.add_option("--out", options.command.out, "Write the bytes to this file")->type_name("FILE");
           }});
}

int Outcome(const MachineConfig& machine, const Options& options) {
  const std::optional<CommandId> id = ParseId(options.id);
  if (!id) return Fail("the id of a command is 32 hex digits", kExitUsage);
  return RunQuery(machine, *id, options.command.json);
}

void AddOutcome(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("outcome", "Show the state or the outcome of an earlier command");
  command->add_option("ID", options->id, "The command's id, 32 hex digits")->required();
  options->config.AddTo(*command, ConfigOption::Form::kOptionOnly);
  command->add_flag("--json", options->command.json, "Print one JSON object");
  command->footer(kCommandExitCodes);
  RunOnMachine<Options>(*command, options, exit_code, &Outcome);
}

}  // namespace

void AddDoCommands(CLI::App& app, int& exit_code) {
  AddDo(app, exit_code);
  AddAliases(app, exit_code);
  AddEeprom(app, exit_code);
  AddOutcome(app, exit_code);
}

void AddHomeCommand(CLI::App& app, int& exit_code) {
  AddVerb(app, exit_code,
          {.name = "home",
           .operation = "set_datum",
           .summary = "Set the value of the present position, in software: the datum",
           .footer = "short for: axlecast do DEVICE set_datum value=V\n"
                     "example: axlecast home axis1 --value 123.456\n"
                     "The encoder is not changed. axlecast datum undo DEVICE reverts it.\n",
           .add_arguments =
               [](CLI::App& command, Options& options) {
                 command
                     .add_option("--value", options.value, "Value of the present position, in the device's unit")
                     ->required()
                     ->check(PlainNumber())
                     ->type_name("V");
               },
           .run =
               [](const MachineConfig& machine, Options& options) {
                 options.command.arguments = {"value=" + options.value};
                 return Run(machine, options);
               }});
}

void AddDatumUndo(CLI::App& datum, int& exit_code) {
  AddVerb(datum, exit_code,
          {.name = "undo",
           .operation = "undo_datum",
           .summary = "Revert to the previous datum",
           .footer = "short for: axlecast do DEVICE undo_datum\nexample: axlecast datum undo axis1\n"});
}

void AddShelvingCommands(CLI::App& app, int& exit_code) {
  AddVerb(app, exit_code,
          {.name = "shelve",
           .operation = kShelveAlarm,
           .summary = "Shelve an alarm for a time, with a reason. This does not clear it",
           .footer = "short for: axlecast do DEVICE shelve_alarm alarm=ALARM seconds=S\n"
                     "example: axlecast shelve axis1 battery_alarm --for 8h --reason \"battery comes at 14:00\"\n"
                     "If the alarm gets worse, it is listed again.\n",
           .has_yes = false,
           .has_two_steps = false,
           .add_arguments =
               [](CLI::App& command, Options& options) {
                 constexpr double kMax = static_cast<double>(AlarmShelves::kLongestUs) / 1e6;
                 command.add_option("ALARM", options.alarm, "The alarm's name")->required();
                 command
                     .add_option("--for", options.seconds,
                                 "Duration: 30s, 15min, 8h; at most 24h. The alarm is then listed again")
                     ->required()
                     ->transform(
                         CLI::AsNumberWithUnit(std::map<std::string, double>{{"s", 1}, {"min", 60}, {"h", 3600}}))
                     ->check(CLI::Range(1.0, kMax))
                     ->type_name("TIME");
               },
           .run =
               [](const MachineConfig& machine, Options& options) {
                 const auto seconds = static_cast<std::int64_t>(options.seconds);
                 options.command.arguments = {"alarm=" + options.alarm, "seconds=" + std::to_string(seconds)};
                 return Run(machine, options);
               }})
      ->get_option("--reason")
      ->required();
  AddVerb(app, exit_code,
          {.name = "unshelve",
           .operation = kUnshelveAlarm,
           .summary = "Unshelve an alarm before its time",
           .footer = "short for: axlecast do DEVICE unshelve_alarm alarm=ALARM\n"
                     "example: axlecast unshelve axis1 battery_alarm\n",
           .has_yes = false,
           .has_two_steps = false,
           .add_arguments =
               [](CLI::App& command, Options& options) {
                 command.add_option("ALARM", options.alarm, "The alarm's name")->required();
               },
           .run =
               [](const MachineConfig& machine, Options& options) {
                 options.command.arguments = {"alarm=" + options.alarm};
                 return Run(machine, options);
               }});
}

void AddMotorCommand(CLI::App& app, int& exit_code) {
  CLI::App* motor = app.add_subcommand("motor", "Stop a monitored motor, or let it start again");
  motor->require_subcommand(1);
  const auto describe_device = [](CLI::App& command, Options&) {
    command.get_option("DEVICE")->description("The motor's monitor");
  };
  AddVerb(*motor, exit_code,
          {.name = "stop",
           .operation = "stop_motor",
           .summary = "Stop the motor without asking. This is not an emergency stop",
           .footer = "example: axlecast motor stop gm3\n"
                     "The command is sent before all others on the bus. Do not use it to protect people.\n",
           .has_yes = false,
           .add_arguments = describe_device});
  AddVerb(*motor, exit_code,
          {.name = "start",
           .operation = "start_motor",
           .summary = "Let the motor run again, after a question",
           .footer = "examples:\n"
                     "  axlecast motor start gm3\n"
                     "  axlecast motor start gm3 --yes --reason \"belt replaced\"\n",
           .add_arguments = [describe_device](CLI::App& command, Options& options) {
             options.command.asks = true;
             describe_device(command, options);
           }});
}

}  // namespace axlecast
