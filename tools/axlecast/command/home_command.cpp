#include "tools/axlecast/command/subcommands.h"

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "tools/axlecast/command/command_options.h"
#include "tools/axlecast/command/command_run.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/exit_code.h"

namespace axlecast {
namespace {

struct Options {
  ConfigOption config;
  CommandOptions wish;
  std::string value;
};

int Run(const Options& options) {
  int exit_code = kExitDone;
  const auto machine = options.config.Load(exit_code);
  return machine ? RunCommand(*machine, options.wish) : exit_code;
}

}  // namespace

void AddHomeCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  options->wish.operation = "set_datum";
  CLI::App* command = app.add_subcommand("home", "Sets what the present position reads, in software: the datum");
  command->add_option("DEVICE", options->wish.device, "The device")->required();
  command->add_option("--value", options->value, "What it shall read, in the device's unit")
      ->required()
      ->check(PlainNumber())
      ->type_name("V");
  AddCommandOptions(*command, options->config, options->wish, true);
  AddTwoStepOptions(*command, options->wish);
  command->footer(std::string("short for: axlecast do DEVICE set_datum value=V\n"
                              "example: axlecast home axis1 --value 123.456\n"
                              "Nothing is changed in the encoder. axlecast datum undo DEVICE takes it back.\n") +
                  kCommandExitCodes);
  command->callback([options, &exit_code] {
    options->wish.words = {"value=" + options->value};
    exit_code = Run(*options);
  });
}

void AddDatumUndo(CLI::App& datum, int& exit_code) {
  auto options = std::make_shared<Options>();
  options->wish.operation = "undo_datum";
  CLI::App* command = datum.add_subcommand("undo", "Takes the newest datum back: the one before holds again");
  command->add_option("DEVICE", options->wish.device, "The device")->required();
  AddCommandOptions(*command, options->config, options->wish, true);
  AddTwoStepOptions(*command, options->wish);
  command->footer(std::string("short for: axlecast do DEVICE undo_datum\nexample: axlecast datum undo axis1\n") +
                  kCommandExitCodes);
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace axlecast
