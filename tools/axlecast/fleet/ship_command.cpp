#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <iostream>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/base/result.h"
#include "core/config/machine_config.h"
#include "core/messages/json/field.h"
#include "core/messages/message.h"
#include "platform/net/lcm_port.h"
#include "platform/os/process.h"
#include "platform/os/secret_file.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/program.h"
#include "tools/axlecast/common/subcommands.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/fleet/metrics_server.h"
#include "tools/axlecast/fleet/ship_metrics.h"
#include "tools/fleet/ship/ship_state.h"
#include "tools/fleet/ship/shipper.h"

namespace axlecast {
namespace {

constexpr MonoNs kJsonInterval = 10 * kSecond;

struct ShipOptions {
  ConfigOption config;
  std::string database;
  std::string password_file;
  std::string folder;
  std::string state;
  std::string metrics;
  bool once = false;
  bool json = false;

  void AddTo(CLI::App& command) {
    config.AddTo(command, ConfigOption::Form::kPositional);
    command
        .add_option("--database", database,
                    "Ship to this database instead of the file's: a connection string of libpq")
        ->type_name("CONNECTION");
    command.add_option("--password-file", password_file, "Read its password from a file of mode 0600")
        ->type_name("FILE");
    command.add_option("--folder", folder, "Ship the logs in this folder instead of the recorder's")
        ->type_name("DIR");
    command
        .add_option("--state", state,
                    "Keep the identity of this installation here; each machine of a host needs its own")
        ->type_name("DIR");
    command
        .add_option("--metrics", metrics,
                    "Serve metrics for Prometheus on this TCP port, of this address instead of 127.0.0.1")
        ->type_name("[ADDRESS:]PORT");
    command.add_flag("--once", once, "Ship everything that is complete in the logs, and end");
    command.add_flag("--json", json, "Print the status as one JSON object per line, every 10 s and at the end");
  }
};

// One run of the command. A thread ships, and may wait for the database; the calling thread reports.
class ShipRun {
 public:
  ShipRun(const ShipOptions& options, const MachineConfig& machine, const ShipState& state,
          ShipperSettings settings)
      : options_(options),
        machine_(machine),
        origin_(NewOrigin(machine.machine)),
        port_(machine.lcm.url, machine.lcm.prefix, machine.machine),
        database_(DatabaseOf(state), secrets_, clock_),
        shipper_(WithStop(std::move(settings)), database_, clock_),
        alarms_(machine.machine, origin_) {}

  [[nodiscard]] ShipEnd Run() {
    if (!port_.problem().empty()) std::cerr << "no alarms are published: " << port_.problem() << '\n';
    ShipEnd end = ShipEnd::kStopped;
    std::thread worker([this, &end] {
      end = shipper_.Run();
      ended_.Set();
    });
    supervision_.Ready();
    bool stopping = false;
    for (bool running = true; running;) {
      Report();
      std::array<pollfd, 2> files = {
          {{stop_signal_.FileDescriptor(), POLLIN, 0}, {ended_.FileDescriptor(), POLLIN, 0}}};
      if (stopping) files[0].fd = -1;
      static_cast<void>(PollUntil(files, clock_.Now() + kSecond, clock_));
      if (!stopping && stop_signal_.Requested()) {
        stopping = true;
        supervision_.Stopping();
        stop_.Set();
      }
      running = (files[1].revents & POLLIN) == 0;
    }
    worker.join();
    next_report_ = 0;
    Report();
    return end;
  }

  [[nodiscard]] ShipStatus status() const { return shipper_.Status(); }
  [[nodiscard]] nlohmann::ordered_json StatusJson(const char* state) const {
    return ShipStatusJson(machine_.machine, state, clock_.UtcMicroseconds(), status());
  }

 private:
  [[nodiscard]] ShipDatabaseSettings DatabaseOf(const ShipState& state) const {
    return {.connection = machine_.ship.database,
            .password = machine_.ship.password,
            .machine = machine_.machine,
            .installation = state.installation().id,
            .shipper = HostName() + " process " + std::to_string(getpid()),
            .stop = stop_.FileDescriptor()};
  }
  [[nodiscard]] ShipperSettings WithStop(ShipperSettings settings) const {
    settings.stop = stop_.FileDescriptor();
    return settings;
  }

  void Report() {
    const MonoNs now = clock_.Now();
    supervision_.Progress(now);
    if (now < next_report_) return;
    next_report_ = now + kSecond;
    const ShipStatus status = shipper_.Status();
    if (port_.problem().empty()) {
      static_cast<void>(Publish(port_, "ALARM/" + ShipAlarmName(machine_.machine),
                                alarms_.Make(status, now, clock_.UtcMicroseconds())));
    }
    supervision_.Status(ShipStatusLine(status));
    ReportChanges(status);
    if (options_.json && now >= next_json_) {
      next_json_ = now + kJsonInterval;
      static_cast<void>(WriteOut(JsonLine(StatusJson("running")) + '\n'));
    }
    if (!options_.json && isatty(STDERR_FILENO) != 0) {
      std::cerr << "\x1b[2K\r" << ShipStatusLine(status) << std::flush;
      shown_ = true;
    }
  }

  void Print(const std::string& line) {
    if (std::exchange(shown_, false)) std::cerr << '\n';
    std::cerr << line << '\n';
  }

  void PrintNew(const std::string& problem, const std::string& before) {
    if (!problem.empty() && problem != before) Print(problem);
  }

  void ReportChanges(const ShipStatus& status) {
    if (status.connected && !reported_.connected) Print("connected to " + status.host);
    PrintNew(status.problems.database, reported_.problems.database);
    PrintNew(status.problems.folder, reported_.problems.folder);
    PrintNew(status.problems.marks, reported_.problems.marks);
    PrintNew(status.problems.retention, reported_.problems.retention);
    for (const SkippedLog& log : status.skipped) {
      if (std::ranges::find(reported_.skipped, log) == reported_.skipped.end()) {
        Print(log.file + " is not shipped: " + log.reason);
      }
    }
    if (status.holes > reported_.holes) {
      Print(std::to_string(status.holes - reported_.holes) +
            " holes recorded: axlecast fleet status names their causes");
    }
    reported_ = status;
  }

  const ShipOptions& options_;
  const MachineConfig& machine_;
  SystemClock clock_;
  StopSignal stop_signal_;
  WakeEvent stop_;
  WakeEvent ended_;
  Origin origin_;
  LcmPort port_;
  SecretFiles secrets_;
  ShipDatabase database_;
  Shipper shipper_;
  ShipAlarms alarms_;
  Supervision supervision_;
  MonoNs next_report_ = 0;
  MonoNs next_json_ = 0;
  bool shown_ = false;  // a line of progress without its end
  ShipStatus reported_;
};

// Replaces values of the machine's file by those of the command line.
[[nodiscard]] Result<> ApplyShipOptions(const ShipOptions& options, ShipConfig& ship) {
  if (!options.database.empty()) ship.database = options.database;
  if (!options.password_file.empty()) ship.password = {options.password_file, "", false};
  if (!options.metrics.empty()) ship.metrics = options.metrics;
  if (ship.database.empty()) {
    return Failure(
        "no database: put `ship: {database: \"host=db1 dbname=axlecast\"}` into the machine's file, or give "
        "--database");
  }
  for (const ConfigFault& fault : FaultsOf(ship))
    return Failure("ship." + std::string(fault.key) + ": " + fault.text);
  return {};
}

// Serves the metrics of `run` if the machine's file or the command line gives an address; otherwise returns null.
Result<std::unique_ptr<MetricsServer>> ServeMetrics(const MachineConfig& machine, const ShipRun& run) {
  if (machine.ship.metrics.empty()) return nullptr;
  const Result<ListenAddress> listen = ParseListenAddress(machine.ship.metrics);
  if (!listen) return Failure(listen.error());
  std::vector<std::string> names = machine.web.names;
  names.push_back(HostName());
  return StartMetricsServer(*listen, std::move(names), [&run] { return ShipMetricsText(run.status()); });
}

int ExitCodeOf(ShipEnd end) {
  switch (end) {
    case ShipEnd::kStopped:
    case ShipEnd::kComplete:
      return kExitDone;
    case ShipEnd::kPartly:
      return kExitLosses;
    case ShipEnd::kFailed:
      return kExitFailed;
    case ShipEnd::kFenced:
      return kExitReplaced;
  }
  return kExitFailed;
}

int RunShip(const ShipOptions& options) {
  Result<MachineConfig> machine = options.config.Load();
  if (!machine) return options.config.Fail(machine.error());
  if (const Result<> applied = ApplyShipOptions(options, machine->ship); !applied) {
    return Fail(applied.error().text, kExitUsage);
  }
  Result<DetailRules> detail = DetailRulesOf(machine->ship);
  if (!detail) return Fail(detail.error().text, kExitBad);
  ShipState state;
  if (const Result<> opened = state.Open(options.state.empty() ? DefaultShipState() : options.state); !opened) {
    return Fail(opened.error().text, kExitFailed);
  }
  if (const Result<> added = state.AddName(machine->machine); !added) return Fail(added.error().text, kExitFailed);
  if (const Result<> forbidden = ForbidCoreDumps(); !forbidden)
    std::cerr << "warning: " << forbidden.error().text << '\n';
  ShipperSettings settings{.folder = options.folder.empty() ? LogDirectory(*machine) : options.folder,
                           .names = state.installation().names,
                           .detail = *std::move(detail),
                           .newest_first = machine->ship.newest_first,
                           .bandwidth = machine->ship.bandwidth,
                           .once = options.once};
  std::cerr << "machine " << machine->machine << ": logs of " << settings.folder << " to " << machine->ship.database
            << '\n';
  ShipRun run(options, *machine, state, std::move(settings));
  const auto metrics = ServeMetrics(*machine, run);
  if (!metrics) return Fail(metrics.error().text, kExitFailed);
  const ShipEnd end = run.Run();
  if (options.json) {
    static_cast<void>(WriteOut(JsonLine(run.StatusJson("ended")) + '\n'));
  } else {
    std::cerr << ShipStatusLine(run.status()) << '\n';
  }
  return ExitCodeOf(end);
}

}  // namespace

void AddShipCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ShipOptions>();
  CLI::App* command =
      app.add_subcommand("ship", "Write the recorder's logs to the fleet database, each message once");
  options->AddTo(*command);
  command->footer(
      "examples:\n"
      "  axlecast ship machine.yaml                          to the database of the machine's file (ship:)\n"
      "  axlecast ship --once --json                         everything that is recorded, and end\n"
      "  axlecast ship --database 'host=db1 dbname=axlecast user=axlecast_press' --password-file ship.password\n"
      "  axlecast ship --folder /mnt/old/press3 --once       logs of a folder that was kept elsewhere\n"
      "Prepare the database with `axlecast fleet init`. Several processes may not ship one machine: the newest one "
      "replaces the others.\n"
      "exit code: 0 done, 1 the machine's file is bad, 2 usage, 3 (--once) a log could not be shipped or has "
      "holes, 4 "
      "failed,\n"
      "8 another shipper has taken the machine over");
  command->callback([options, &exit_code] { exit_code = RunShip(*options); });
}

}  // namespace axlecast
