#include <poll.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/result.h"
#include "core/config/service_config.h"
#include "platform/net/lcm_port.h"
#include "platform/net/web_server.h"
#include "platform/os/descriptor.h"
#include "platform/os/process.h"
#include "platform/os/secret_file.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/program.h"
#include "tools/axlecast/common/subcommands.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/logs/log_input.h"
#include "tools/axlecast/run/web_server_options.h"
#include "tools/log/log_merge.h"
#include "tools/metrics/metrics_text.h"
#include "tools/web/fleet/fleet_page_reader.h"
#include "tools/web/web_app.h"

namespace axlecast {
namespace {

struct WebOptions {
  ConfigOption config;
  std::vector<std::string> logs;
  WebServerOptions server;
  std::optional<std::string> fleet;
  std::optional<std::string> fleet_password;

  void AddTo(CLI::App& command) {
    config.AddTo(command, ConfigOption::Form::kPositional);
    command.add_option("--log", logs, "Show these recorded logs instead of the live machine")->type_name("FILE");
    server.AddTo(command, "Serve on this TCP port instead of the file's (8380); 0: any free port",
                 "File of the token for browsers to sign in, mode 0600 or 0640",
                 "Maximum number of browsers at the same time");
    command
        .add_option("--fleet", fleet,
                    "Also show the machines of this fleet database; without a machine's file, only them")
        ->type_name("CONNECTION")
        ->excludes("--log");
    command
        .add_option("--fleet-password-file", fleet_password,
                    "File of the password for the fleet database, mode 0600 or 0640")
        ->type_name("FILE")
        ->needs("--fleet");
  }

  // Replaces values of the machine's file by those of the command line.
  [[nodiscard]] WebConfig Over(WebConfig web) const {
    web = server.Over(std::move(web));
    if (fleet) {
      web.fleet_database = *fleet;
      web.fleet_password = fleet_password ? SecretFileAt(*fleet_password) : SecretPlace{};
    }
    return web;
  }
};

constexpr int kQueue = 50'000;         // messages, between two ticks
constexpr int kMaxHandles = 20;        // per tick, so that browsers are served under any load
constexpr int kSpareConnections = 32;  // for HTTP requests and monitoring, in addition to the browsers' WebSockets

// Receives the messages of the live machine.
class LiveSource {
 public:
  LiveSource(const MachineConfig& machine, const Clock& clock)
      : clock_(clock), model_(machine, AXLECAST_VERSION, std::nullopt, NewOrigin(machine.machine).clock_id) {
    Listen(machine, machine.lcm.url, Monitor::kDataChannels);
    Listen(machine, machine.lcm.command_url, Monitor::kCommandChannels);
  }

  [[nodiscard]] const std::string& problem() const { return problem_; }
  [[nodiscard]] WebModel& model() { return model_; }

  // Processes the received messages.
  void Gather() {
    for (LcmPort& port : ports_) {
      pollfd waits = {port.FileDescriptor(), POLLIN, 0};
      for (int i = 0; i < kMaxHandles && problem_.empty() && poll(&waits, 1, 0) > 0; ++i) {
        if (!port.Handle(0)) problem_ = "the LCM port failed";
      }
    }
    ReceptionCounts counts;
    for (const LcmPort& port : ports_) counts += port.received();
    model_.OnReception(counts);
    const MonoNs now = clock_.Now();
    model_.Tick(now);
    if (const std::string lost = reception_.NextLine(counts, now, ports_.front().warning()); !lost.empty()) {
      std::cerr << lost << '\n';
    }
  }

 private:
  void Listen(const MachineConfig& machine, const std::string& url, const char* channels) {
    LcmPort& port = ports_.emplace_back(url, machine.lcm.prefix, machine.machine);
    const auto handler = [this](const std::string& channel, Bytes message) {
      model_.OnMessage(channel, message, {clock_.Now(), clock_.UtcMicroseconds()});
    };
    if (problem_.empty()) problem_ = port.problem();
    if (problem_.empty() && !port.Subscribe(channels, handler, kQueue)) problem_ = "cannot subscribe on " + url;
  }

  const Clock& clock_;
  WebModel model_;
  std::list<LcmPort> ports_;
  ReceptionReport reception_;
  std::string problem_;
};

// Reads recorded logs.
class LogSource {
 public:
  LogSource(const std::vector<std::string>& paths, const Clock& clock) : clock_(clock) {
    for (const std::string& path : paths) {
      const OpenedLog& file = files_.emplace_back(OpenLog(path));
      if (problem_.empty()) problem_ = file.problem();
      if (!file.damage().empty()) std::cerr << "warning: " << file.damage() << '\n';
      bytes_.push_back(file.bytes());
      facts_.files.push_back(std::filesystem::path(path).filename());
    }
    const LogSpan span = SpanOf(bytes_);
    facts_.first_utime = span.first;
    facts_.last_utime = span.last;
    if (problem_.empty() && span.first == 0 && span.last == 0) problem_ = paths.front() + ": contains no message";
  }

  [[nodiscard]] const std::string& problem() const { return problem_; }

  // `machine`: from --config; without it, the machine of the log is used.
  void SetMachine(std::optional<MachineConfig> machine) {
    if (!machine) {
      if (Result<MachineConfig> recorded = MachineOf(bytes_.front(), files_.front().path()); recorded) {
        machine = std::move(*recorded);
      } else {
        std::cerr << "warning: " << recorded.error().text << "only the received messages are shown\n";
      }
    }
    machine_ = machine.value_or(MachineConfig{});
  }
  [[nodiscard]] const std::string& machine() const { return machine_.machine; }

  [[nodiscard]] std::unique_ptr<LogPlayer> Open() const {
    return std::make_unique<LogPlayer>(bytes_, machine_, AXLECAST_VERSION, facts_, clock_.Now());
  }

  // Returns the error if a file has become unreadable; otherwise an empty text.
  [[nodiscard]] std::string Loss() const {
    for (const OpenedLog& file : files_) {
      if (std::string loss = file.Loss(); !loss.empty()) return loss;
    }
    return "";
  }

 private:
  const Clock& clock_;
  std::list<OpenedLog> files_;
  std::vector<Bytes> bytes_;
  WebLogFacts facts_;
  MachineConfig machine_;
  std::string problem_;
};

// Answers questions to the fleet database on a thread of its own.
class FleetSource {
 public:
  explicit FleetSource(const WebConfig& web)
      : reader_({.connection = web.fleet_database, .password = web.fleet_password, .stop = stop_.FileDescriptor()},
                secrets_, clock_),
        worker_([this](const FleetRequest& request) { return reader_.Answer(request); }, [this] { stop_.Set(); }) {}

  [[nodiscard]] FleetWorker& worker() { return worker_; }

 private:
  const SystemClock clock_;
  SecretFiles secrets_;
  WakeEvent stop_;
  FleetPageReader reader_;
  FleetWorker worker_;  // last: it uses all of the others
};

// Serves `parts` until a signal. `title`: the machine or log that is shown.
int Serve(const WebOptions& options, WebConfig web, const std::string& title, WebSiteParts parts) {
  const Result<Secret> token = ReadWebSecrets(web);
  if (!token) return Fail(token.error().text, kExitBad);
  std::vector<std::string> names = web.names;
  names.push_back(HostName());
  WebAccess access({.names = names, .tls = !web.certificate.empty(), .token_required = !web.token.empty()}, *token);
  const SystemClock clock;
  const StopSignal stop;
  Supervision supervision;
  parts.clock = &clock;
  parts.access = &access;
  parts.files = PageFiles();
  parts.max_clients = options.server.clients;
  parts.tick = [&stop, &clock, &supervision, gather = std::move(parts.tick)] {
    supervision.Progress(clock.Now());
    return gather() && !stop.Requested();
  };
  WebApp site(std::move(parts));
  const int max_connections = static_cast<int>(options.server.clients) + kSpareConnections;
  WebServer server({.address = web.bind,
                    .port = web.port,
                    .certificate = web.certificate,
                    .key = web.key,
                    .max_connections = max_connections,
                    .max_per_address = max_connections / 2,
                    .headers = WebApp::SecurityHeaders()},
                   site);
  if (!server.problem().empty()) return Fail(server.problem(), kExitFailed);
  std::cerr << title << "; Ctrl-C ends it\n";
  web.port = server.port();
  static_cast<void>(WriteOut(WebUrl(web, HostName()) + '\n'));
  supervision.Ready();
  const bool served = server.Run();
  supervision.Stopping();
  return served ? kExitDone : Fail("the server's library failed", kExitFailed);
}

int ServeLive(const WebOptions& options, const WebConfig& web, const MachineConfig& machine) {
  const SystemClock clock;
  LiveSource source(machine, clock);
  if (!source.problem().empty()) return Fail(source.problem(), kExitBad);
  std::optional<FleetSource> fleet;
  if (!web.fleet_database.empty()) fleet.emplace(web);
  WebSiteParts parts;
  parts.live = &source.model();
  if (fleet) {
    parts.fleet = &fleet->worker();
    source.model().SetFleet(WebFleet::kBeside);
  }
  parts.tick = [&source] {
    source.Gather();
    return true;
  };
  parts.problem = [&source] { return source.problem(); };
  parts.metrics = [&source, &clock] {
    return MetricsText(source.model().monitor(), clock.Now(), AXLECAST_VERSION);
  };
  return Serve(options, web, machine.machine, std::move(parts));
}

int ServeFleet(const WebOptions& options, const WebConfig& web) {
  const MachineConfig no_machine;
  WebModel model(no_machine, AXLECAST_VERSION, std::nullopt);
  model.SetFleet(WebFleet::kOnly);
  FleetSource fleet(web);
  WebSiteParts parts;
  parts.live = &model;
  parts.fleet = &fleet.worker();
  parts.tick = [] { return true; };
  parts.problem = [] { return std::string(); };
  return Serve(options, web, "fleet", std::move(parts));
}

int ServeLog(const WebOptions& options, const WebConfig& web, std::optional<MachineConfig> machine) {
  const SystemClock clock;
  LogSource source(options.logs, clock);
  if (!source.problem().empty()) return Fail(source.problem(), kExitBad);
  source.SetMachine(std::move(machine));
  WebSiteParts parts;
  parts.open_log = [&source] { return source.Open(); };
  parts.tick = [] { return true; };
  parts.problem = [&source] { return source.Loss(); };
  return Serve(options, web, "log " + options.logs.front(), std::move(parts));
}

int RunWeb(const WebOptions& options) {
  std::optional<MachineConfig> machine;
  const bool fleet_only = options.fleet && options.config.File().empty();
  if (!fleet_only && (options.logs.empty() || options.config.Given())) {
    Result<MachineConfig> loaded = options.config.Load();
    if (!loaded) return options.config.Fail(loaded.error());
    machine = *std::move(loaded);
  }
  const WebConfig web = options.Over(machine ? machine->web : WebConfig{});
  const std::vector<ConfigFault> faults = FaultsOf(web);
  for (const ConfigFault& fault : faults) std::cerr << "web: " << fault.key << ": " << fault.text << '\n';
  if (!faults.empty()) return kExitUsage;
  if (fleet_only) return ServeFleet(options, web);
  return options.logs.empty() ? ServeLive(options, web, *machine) : ServeLog(options, web, std::move(machine));
}

}  // namespace

void AddWebCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<WebOptions>();
  CLI::App* command =
      app.add_subcommand("web", "Show the machine, or a log, in the browser; it accepts no commands");
  options->AddTo(*command);
  command->footer(
      "examples:\n"
      "  axlecast web                                  the machine's file as usual; open the printed URL\n"
      "  axlecast web --log run7.lcm --port 0          a recorded log, with a time slider; no machine needed\n"
      "  axlecast web --fleet 'host=db1 dbname=axlecast user=viewer'\n"
      "  axlecast web --bind 0.0.0.0 --tls-cert web.pem --tls-key web.key --token-file web.token\n"
      "It also serves /metrics (Prometheus) and /healthz. Other hosts need TLS and a token.\n"
      "exit code: 0 ended by a signal, 1 an input is bad, 2 usage, 4 the address cannot be served");
  command->callback([options, &exit_code] { exit_code = RunWeb(*options); });
}

}  // namespace axlecast
