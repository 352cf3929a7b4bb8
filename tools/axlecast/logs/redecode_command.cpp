#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include "core/base/result.h"
#include "tools/axlecast/common/subcommands.h"
#include "tools/axlecast/common/terminal.h"

#include "platform/os/new_file.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/logs/log_input.h"
#include "tools/redecode/log_redecoder.h"

namespace axlecast {
namespace {

constexpr FileAccess kLogAccess{.mode = 0644};

struct Options {
  std::string log;
  ConfigOption config;
  std::string bus;
  std::string output;
  bool force = false;
  bool diff = false;
  bool json = false;
};

int ResultOf(const Options& options, const LogRedecoder& redecoder, bool readable_whole) {
  bool whole = readable_whole && redecoder.malformed() == 0;
  for (const auto& [name, bus] : redecoder.buses()) whole = whole && bus->gaps().empty() && bus->unreadable() == 0;
  if (redecoder.buses().empty()) {
    return Fail(options.log + " contains no capture" + (options.bus.empty() ? "" : " of bus " + options.bus) +
                    ": record one with `capture: true` on the bus",
                kExitBad);
  }
  return whole && (!options.diff || redecoder.diff().same()) ? kExitDone : kExitLosses;
}

int Run(const Options& options) {
  LogInput input;
  if (!input.Open(options.log)) return kExitBad;
  const Result<MachineConfig> machine =
      options.config.Given() ? options.config.Load() : MachineOf(input.log(), options.log);
  if (!machine) {
    std::cerr << machine.error().text;
    return kExitBad;
  }
  if (!options.bus.empty() && machine->FindBus(options.bus) == nullptr)
    return Fail("the machine has no bus " + options.bus, kExitUsage);
  std::optional<NewFile> output;
  if (!options.output.empty()) output.emplace(options.output, kLogAccess);
  LogEncoder encoder;
  LogRedecoder redecoder(*machine, options.bus, [&](const LogEvent& event) {
    if (output) output->Collect(AsText(encoder.Add(event)));
  });
  input.Read("decoding", [&redecoder](const LogEvent& event, std::size_t) {
    redecoder.On(event);
    return true;
  });
  redecoder.Finish();
  const int readable = input.ExitCode();
  if (readable == kExitBad) return kExitBad;
  if (const Result<> committed = output ? output->Commit(options.force) : Result<>(); !committed)
    return Fail(committed.error().text, kExitBad);
  std::cerr << DamageText(options.log, input.damage());
  Show(ToJson(redecoder, options.diff), ToText(redecoder, options.diff), options.json);
  return ResultOf(options, redecoder, readable == kExitDone);
}

}  // namespace

void AddRedecodeCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command =
      app.add_subcommand("redecode", "Decode the captured bytes of a log again with the drivers of this version");
  command->add_option("LOG", options->log, "Log with channels WIRE/<bus>, recorded with `capture: true`")
      ->required();
  options->config.AddTo(*command, ConfigOption::Form::kOptionOnly);
  command->add_option("--bus", options->bus, "Decode only this bus")->type_name("BUS");
  command->add_option("-o,--output", options->output, "Write the decoded messages to a log")->type_name("FILE");
  command->add_flag("--force", options->force, "Replace FILE if it exists");
  command->add_flag("--diff", options->diff, "Compare positions and motor values with those in the log");
  command->add_flag("--json", options->json, "Print one JSON object");
  command->footer(
      "The machine's file in the log is used, unless --config gives another file. With a changed scale, datum or "
      "model,\n"
      "the result shows their effect on the same bytes.\n"
      "examples:\n"
      "  axlecast redecode run.lcm --diff\n"
      "  axlecast redecode run.lcm --config changed.yaml --bus rs485-0 -o again.lcm\n"
      "exit codes: 0 complete, and without differences; 3 gaps, damage or differences; 1 no capture, or not "
      "readable");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace axlecast
