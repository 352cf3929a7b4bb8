#include "tools/axlecast/setup/subcommands.h"

#include <sys/utsname.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "core/messages/decode_message.h"
#include "platform/os/new_file.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/device_data/device_access.h"
#include "tools/axlecast/logs/log_input.h"
#include "tools/axlecast/setup/report_page.h"
#include "tools/monitor/live_machine.h"

namespace axlecast {
namespace {

constexpr MonoNs kLongestWait = 6 * kSecond;  // monitors of a full bus are read every few seconds

struct Options {
  ConfigOption config;
  std::string html;
  std::string key;
  std::vector<std::string> logs;
  bool no_reads = false;
};

// False when a log cannot be read, which is said on standard error.
bool ReadLogs(const Options& options, const std::string& prefix, ReportContents& contents) {
  for (const std::string& file : options.logs) {
    LogInput input;
    if (!input.Open(file)) return false;
    input.Read("reading", [&](const LogEvent& event, std::size_t) {
      if (!event.channel.starts_with(prefix + "BUS/")) return true;
      if (const auto health = DecodeMessage<bus_health_t>(event.data)) contents.trend.OnBus(*health);
      return true;
    });
    if (input.ExitCode() == kExitBad) return false;
    contents.logs.push_back(file);
  }
  return true;
}

// On standard error, which a page on standard output leaves alone.
void Progress(const std::string& text) { std::cerr << text << '\n'; }

void ReadDevices(const Options& options, const MachineConfig& machine, ReportContents& contents) {
  OperatorClient client(machine, options.key, false);
  std::size_t devices = 0;
  for (const BusConfig& bus : machine.buses) devices += bus.devices.size();
  std::size_t number = 0;
  for (const BusConfig& bus : machine.buses) {
    for (const DeviceConfig& device : bus.devices) {
      Progress("reading parameters and memory of " + device.name + " (" + std::to_string(++number) + " of " +
               std::to_string(devices) + ")");
      const std::vector<DeviceRead> reads = ReadEverything(client, bus, device.name);
      FindingGroup group = ReadFindings(bus, reads);
      group.title = "Parameters and memory of " + device.name;
      contents.reads.push_back(std::move(group));
      if (!reads.empty() && !reads.back().result.answered) {
        return Progress("no bridge answers: parameters and memory are left out");
      }
    }
  }
}

void ReadJournal(const MachineConfig& machine, ReportContents& contents) {
  HistoryReader reader(JournalFile(machine));
  contents.records = reader.Devices();
  contents.journal_problem = reader.problem();
}

int RunReport(const Options& options) {
  int exit_code = kExitDone;
  const auto machine = options.config.Load(exit_code);
  if (!machine) return exit_code;
  const SystemClock clock;
  ReportContents contents;
  if (!ReadLogs(options, machine->lcm.prefix, contents)) return kExitBad;
  Progress("listening to the machine, at most " + std::to_string(kLongestWait / kSecond) + " s");
  LiveMachine live(*machine, clock);
  const auto all = [](const MachineView& view) { return view.AllHeard() && view.bridge().heard(); };
  if (!live.problem().empty() || !live.Gather(clock.Now() + kLongestWait, all)) {
    std::cerr << (live.problem().empty() ? "the LCM port failed" : live.problem()) << '\n';
    return kExitFailed;
  }
  const MonoNs heard_at = clock.Now();
  for (const BusView& bus : live.view().buses()) {
    if (contents.logs.empty() && bus.health) contents.trend.OnBus(*bus.health);
  }
  utsname system{};
  if (uname(&system) == 0) {
    contents.host = system.nodename;
    contents.kernel = std::string(system.sysname) + ' ' + system.release + ' ' + system.machine;
  }
  contents.utime = clock.UtcMicroseconds();
  ReadJournal(*machine, contents);
  if (!options.no_reads && !live.view().NoneHeard()) ReadDevices(options, *machine, contents);
  const std::string page = ReportPage(*machine, live.view(), heard_at, contents);
  if (options.html.empty()) return WriteOut(page) ? kExitDone : kExitFailed;
  const std::string problem = WriteOutput(options.html, page);
  Progress(problem.empty() ? "written: " + options.html : problem);
  return problem.empty() ? kExitDone : kExitFailed;
}

}  // namespace

void AddReportCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("report", "The machine as one page, for acceptance and service");
  options->config.AddTo(*command, ConfigOption::Form::kPositional);
  command->add_option("--html", options->html, "The page (default: standard output)")->type_name("FILE");
  command->add_option("--log", options->logs, "A recording whose errors are shown by hours; again for more")
      ->type_name("LOG");
  command->add_option("--key", options->key, "Secret key that signs the reads")->type_name("FILE");
  command->add_flag("--no-reads", options->no_reads, "Reads nothing through the bridge");
  command->footer(
      "examples:\n"
      "  axlecast report --html press3.html\n"
      "  axlecast report machine.yaml --log /var/log/axlecast/press3/*.lcm --html press3.html\n"
      "Nothing is written to a device; what does not run is said on the page. Passwords are masked.\n"
      "exit code: 0 done, 1 the machine's file or a log is bad, 2 usage, 4 failed");
  command->callback([options, &exit_code] { exit_code = RunReport(*options); });
}

}  // namespace axlecast
