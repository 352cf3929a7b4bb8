#include "tools/axlecast/command/subcommands.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <optional>

#include "core/command/command_id.h"
#include "tools/axlecast/command/command_options.h"
#include "tools/axlecast/command/command_run.h"
#include "tools/axlecast/command/do_request.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/screen.h"
#include "tools/axlecast/live/status_text.h"

namespace axlecast {
namespace {

struct Options {
  ConfigOption config;
  CommandOptions wish;
  bool list = false;
  std::string address;  // of the EEPROM aliases, as count and data
  std::string count;
  std::string data;
  std::string id;  // of `outcome`
};

int Run(const Options& options) {
  int exit_code = kExitDone;
  const auto machine = options.config.Load(exit_code);
  return machine ? RunCommand(*machine, options.wish) : exit_code;
}

int List(const Options& options) {
  int exit_code = kExitDone;
  const auto machine = options.config.Load(exit_code);
  if (!machine) return exit_code;
  const BusConfig* bus = machine->BusOf(options.wish.device);
  if (bus == nullptr) {
    std::cerr << UnknownDevice(*machine, options.wish.device) << '\n';
    return kExitUsage;
  }
  static_cast<void>(WriteOut(OperationList(*bus)));
  return kExitDone;
}

int Do(const Options& options) {
  if (options.list) return List(options);
  if (!options.wish.operation.empty()) return Run(options);
  std::cerr << "which operation? axlecast do " << options.wish.device << " --list shows them\n";
  return kExitUsage;
}

void AddDo(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("do", "Has a device do an operation");
  command->add_option("DEVICE", options->wish.device, "The device")->required();
  command->add_option("OPERATION", options->wish.operation, "The operation, by its effect");
  command->add_option("ARGUMENTS", options->wish.words, "Its arguments")->type_name("KEY=VALUE");
  command->add_flag("--list", options->list, "List the device's operations");
  AddCommandOptions(*command, options->config, options->wish, true);
  AddTwoStepOptions(*command, options->wish);
  command->footer(std::string("examples:\n"
                              "  axlecast do axis1 --list\n"
                              "  axlecast do axis1 eeprom_read address=0 count=8\n"
                              "  axlecast do axis1 zero_single_turn --yes --json\n"
                              "  axlecast do axis1 zero_single_turn --prepare\n"
                              "  axlecast do axis1 zero_single_turn --commit TOKEN\n") +
                  kCommandExitCodes);
  command->callback([options, &exit_code] { exit_code = Do(*options); });
}

// The zero of a multi-turn encoder is of its single turn only, and its name says so.
int Zero(Options& options) {
  int exit_code = kExitDone;
  const auto machine = options.config.Load(exit_code);
  if (!machine) return exit_code;
  options.wish.operation = "zero";
  if (FindOperation(*machine, options.wish.device, "zero_single_turn").operation != nullptr) {
    options.wish.operation = "zero_single_turn";
  }
  return RunCommand(*machine, options.wish);
}

void AddZero(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("zero", "Sets the single-turn position to zero, in the device");
  command->add_option("DEVICE", options->wish.device, "The device")->required();
  AddCommandOptions(*command, options->config, options->wish, true);
  AddTwoStepOptions(*command, options->wish);
  command->footer(std::string("short for: axlecast do DEVICE zero_single_turn, or zero, as its family calls it\n") +
                  kCommandExitCodes);
  command->callback([options, &exit_code] { exit_code = Zero(*options); });
}

// A command named by the effect of one operation without arguments.
void AddAlias(CLI::App& app, int& exit_code, const char* name, const char* operation, const char* help) {
  auto options = std::make_shared<Options>();
  options->wish.operation = operation;
  CLI::App* command = app.add_subcommand(name, help);
  command->add_option("DEVICE", options->wish.device, "The device")->required();
  AddCommandOptions(*command, options->config, options->wish, true);
  AddTwoStepOptions(*command, options->wish);
  command->footer(std::string("short for: axlecast do DEVICE ") + operation + '\n' + kCommandExitCodes);
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

void AddEepromRead(CLI::App& eeprom, int& exit_code) {
  auto options = std::make_shared<Options>();
  options->wish.operation = "eeprom_read";
  CLI::App* command = eeprom.add_subcommand("read", "Reads bytes");
  command->add_option("DEVICE", options->wish.device, "The device")->required();
  command->add_option("ADDRESS", options->address, "First address")->required();
  command->add_option("COUNT", options->count, "Number of bytes");
  AddCommandOptions(*command, options->config, options->wish, false);
  AddTwoStepOptions(*command, options->wish);
  command->footer(std::string("example: axlecast eeprom read axis1 0 8\n") + kCommandExitCodes);
  command->callback([options, &exit_code] {
    options->wish.words = {"address=" + options->address};
    if (!options->count.empty()) options->wish.words.push_back("count=" + options->count);
    exit_code = Run(*options);
  });
}

void AddEepromWrite(CLI::App& eeprom, int& exit_code) {
  auto options = std::make_shared<Options>();
  options->wish.operation = "eeprom_write";
  CLI::App* command = eeprom.add_subcommand("write", "Writes bytes and reads them back");
  command->add_option("DEVICE", options->wish.device, "The device")->required();
  command->add_option("ADDRESS", options->address, "First address")->required();
  command->add_option("HEX", options->data, "The bytes, e.g. \"A1 05\"")->required();
  AddCommandOptions(*command, options->config, options->wish, true);
  AddTwoStepOptions(*command, options->wish);
  command->footer(std::string("example: axlecast eeprom write axis1 72 \"A1 05\"\n") + kCommandExitCodes);
  command->callback([options, &exit_code] {
    options->wish.words = {"address=" + options->address, "data=" + options->data};
    exit_code = Run(*options);
  });
}

void AddEepromBackup(CLI::App& eeprom, int& exit_code) {
  auto options = std::make_shared<Options>();
  options->wish.operation = "eeprom_backup";
  CLI::App* command = eeprom.add_subcommand("backup", "Reads the whole memory");
  command->add_option("DEVICE", options->wish.device, "The device")->required();
  command->add_option("--out", options->wish.out, "Write what was read to this file")->type_name("FILE");
  AddCommandOptions(*command, options->config, options->wish, false);
  AddTwoStepOptions(*command, options->wish);
  command->footer(std::string("example: axlecast eeprom backup axis1 --out axis1.eeprom\n") + kCommandExitCodes);
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

int Outcome(const Options& options) {
  const std::optional<CommandId> id = ParseId(options.id);
  if (!id) {
    std::cerr << "a command's id is 32 hex digits\n";
    return kExitUsage;
  }
  int exit_code = kExitDone;
  const auto machine = options.config.Load(exit_code);
  return machine ? RunQuery(*machine, *id, options.wish.json) : exit_code;
}

void AddOutcome(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("outcome", "How a command that was given earlier stands or ended");
  command->add_option("ID", options->id, "The command's id, 32 hex digits")->required();
  options->config.AddTo(*command, ConfigOption::Form::kOptionOnly);
  command->add_flag("--json", options->wish.json, "One JSON object");
  command->footer(kCommandExitCodes);
  command->callback([options, &exit_code] { exit_code = Outcome(*options); });
}

}  // namespace

void AddDoCommands(CLI::App& app, int& exit_code) {
  AddDo(app, exit_code);
  AddZero(app, exit_code);
  AddAlias(app, exit_code, "reset-turns", "reset_turns_and_errors",
           "Sets the multi-turn counter to zero and clears the errors, in the device");
  AddAlias(app, exit_code, "clear-errors", "clear_errors", "Clears the device's latched errors");
  CLI::App* eeprom = app.add_subcommand("eeprom", "The device's memory: read, write, backup");
  eeprom->require_subcommand(1);
  AddEepromRead(*eeprom, exit_code);
  AddEepromWrite(*eeprom, exit_code);
  AddEepromBackup(*eeprom, exit_code);
  AddOutcome(app, exit_code);
}

}  // namespace axlecast
