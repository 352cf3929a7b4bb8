#include "tools/axlecast/command/subcommands.h"

#include <CLI/CLI.hpp>
#include <memory>

#include "tools/axlecast/command/command_options.h"
#include "tools/axlecast/command/command_run.h"
#include "tools/axlecast/common/exit_code.h"

namespace axlecast {
namespace {

struct Options {
  ConfigOption config;
  CommandOptions wish;
};

int Run(const Options& options) {
  int exit_code = kExitDone;
  const auto machine = options.config.Load(exit_code);
  return machine ? RunCommand(*machine, options.wish) : exit_code;
}

CLI::App* Add(CLI::App& motor, int& exit_code, const char* name, const char* operation, bool asks,
              const char* help) {
  auto options = std::make_shared<Options>();
  options->wish.operation = operation;
  options->wish.asks = asks;
  CLI::App* command = motor.add_subcommand(name, help);
  command->add_option("DEVICE", options->wish.device, "The motor's monitor")->required();
  AddCommandOptions(*command, options->config, options->wish, asks);
  AddTwoStepOptions(*command, options->wish);
  command->callback([options, &exit_code] { exit_code = Run(*options); });
  return command;
}

}  // namespace

void AddMotorCommand(CLI::App& app, int& exit_code) {
  CLI::App* motor = app.add_subcommand("motor", "Stops a monitored motor, lets it start again");
  motor->require_subcommand(1);
  Add(*motor, exit_code, "stop", "stop_motor", false, "Stops the motor; does not ask. Not an emergency stop")
      ->footer(
          std::string("example: axlecast motor stop gm3\n"
                      "It goes out before everything else on the bus. For the safety of people there are other "
                      "means.\n") +
          kCommandExitCodes);
  Add(*motor, exit_code, "start", "start_motor", true, "Lets the motor run again; asks first")
      ->footer(std::string("examples:\n"
                           "  axlecast motor start gm3\n"
                           "  axlecast motor start gm3 --yes --reason \"belt replaced\"\n") +
               kCommandExitCodes);
}

}  // namespace axlecast
