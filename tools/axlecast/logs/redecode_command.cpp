#include "core/base/result.h"
#include "tools/axlecast/logs/subcommands.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/messages/json/field.h"
#include "platform/os/new_file.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/logs/log_input.h"
#include "tools/redecode/log_redecoder.h"

namespace axlecast {
namespace {

constexpr std::size_t kChunk = 1U << 20;  // of what is written
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

// The log that the devices' messages become.
class RedecodedLog {
 public:
  explicit RedecodedLog(const std::string& path) {
    if (!path.empty()) file_.emplace(path, kLogAccess);
  }

  void Append(const LogEvent& event) {
    if (!file_ || !problem_.empty()) return;
    AppendEvent(waiting_, event);
    if (waiting_.size() >= kChunk) Flush();
  }
  // The cause where it could not be written, else empty.
  [[nodiscard]] std::string Commit(bool replace) {
    if (!file_) return "";
    Flush();
    return problem_.empty() ? ErrorText(file_->Commit(replace)) : problem_;
  }

 private:
  void Flush() {
    problem_ = ErrorText(file_->Append({reinterpret_cast<const char*>(waiting_.data()), waiting_.size()}));
    waiting_.clear();
  }

  std::optional<NewFile> file_;
  std::vector<std::uint8_t> waiting_;
  std::string problem_;
};

int Judge(const Options& options, const LogRedecoder& redecoder, bool readable_whole) {
  bool whole = readable_whole && redecoder.malformed() == 0;
  for (const auto& [name, bus] : redecoder.buses()) whole = whole && bus->gaps().empty() && bus->unreadable() == 0;
  if (redecoder.buses().empty()) {
    std::cerr << options.log << " holds no capture" << (options.bus.empty() ? "" : " of bus " + options.bus)
              << ": record one with `capture: true` on the bus\n";
    return kExitBad;
  }
  return whole && (!options.diff || redecoder.diff().same()) ? kExitDone : kExitLosses;
}

int Run(const Options& options) {
  LogInput input;
  if (!input.Open(options.log)) return kExitBad;
  int exit_code = kExitBad;
  std::string no_machine;
  const auto machine =
      options.config.Given() ? options.config.Load(exit_code) : MachineOf(input.log(), options.log, no_machine);
  std::cerr << no_machine;
  if (!machine) return exit_code;
  if (!options.bus.empty() && machine->FindBus(options.bus) == nullptr) {
    std::cerr << "the machine has no bus " << options.bus << '\n';
    return kExitUsage;
  }
  RedecodedLog output(options.output);
  LogRedecoder redecoder(*machine, options.bus, [&output](const LogEvent& event) { output.Append(event); });
  input.Read("decoding", [&redecoder](const LogEvent& event, std::size_t) {
    redecoder.On(event);
    return true;
  });
  redecoder.Finish();
  const int readable = input.ExitCode();
  if (readable == kExitBad) return kExitBad;
  if (const std::string problem = output.Commit(options.force); !problem.empty()) {
    std::cerr << problem << '\n';
    return kExitBad;
  }
  std::cerr << DamageText(options.log, input.damage());
  static_cast<void>(
      WriteOut(options.json ? JsonLine(ToJson(redecoder, options.diff)) + '\n' : ToText(redecoder, options.diff)));
  return Judge(options, redecoder, readable == kExitDone);
}

}  // namespace

void AddRedecodeCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "redecode",
      "Runs the drivers' code over the captured bytes of a log: what the devices said then, decoded now");
  command->add_option("LOG", options->log, "A log with WIRE/<bus>: recorded with `capture: true`")->required();
  options->config.AddTo(*command, ConfigOption::Form::kOptionOnly);
  command->add_option("--bus", options->bus, "This bus only")->type_name("BUS");
  command->add_option("-o,--output", options->output, "The messages that come of it, as a log")->type_name("FILE");
  command->add_flag("--force", options->force, "Replace a FILE that is there");
  command->add_flag("--diff", options->diff, "Compare positions and motor values with those in the log");
  command->add_flag("--json", options->json, "One JSON object");
  command->footer(
      "The machine's file is the one that the log begins with, unless --config gives another: a changed scale, "
      "datum\n"
      "or model then shows what it would have made of the same bytes.\n"
      "examples:\n"
      "  axlecast redecode run.lcm --diff\n"
      "  axlecast redecode run.lcm --config changed.yaml --bus rs485-0 -o again.lcm\n"
      "exit codes: 0 whole, and the same with --diff; 3 gaps, damage or differences; 1 no capture, or it cannot be "
      "read");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace axlecast
