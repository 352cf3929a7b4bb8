#include <poll.h>

#include <CLI/CLI.hpp>
#include <fstream>
#include <iostream>
#include <list>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "core/base/result.h"
#include "core/base/text.h"
#include "platform/net/lcm_port.h"
#include "platform/net/web_server.h"
#include "platform/os/process.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/program.h"
#include "tools/axlecast/common/subcommands.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/run/web_server_options.h"
#include "tools/foxglove/foxglove_app.h"
#include "tools/recorder/log_composer.h"

namespace axlecast {
namespace {

constexpr int kDefaultPort = 8765;     // as other servers of the protocol
constexpr int kQueue = 50'000;         // messages, between two ticks
constexpr int kMaxHandles = 20;        // per tick, so that viewers are served under any load
constexpr int kSpareConnections = 16;  // for HTTP requests, in addition to the viewers' WebSockets
constexpr const char* kEveryChannel = ".*";

struct FoxgloveOptions {
  ConfigOption config;
  WebServerOptions server;
  std::vector<std::string> types;
  std::vector<std::string> origins;

  void AddTo(CLI::App& command) {
    config.AddTo(command, ConfigOption::Form::kPositional);
    server.AddTo(command, "Serve on this TCP port (8765); 0: any free port",
                 "File of the token that viewers send, as Bearer or as ?token=, mode 0600 or 0640",
                 "Maximum number of viewers at the same time");
    command.add_option("--types", types, "Also show messages of the types in this .lcm file")->type_name("FILE");
    command.add_option("--origin", origins, "Accept pages of this origin, such as https://app.foxglove.dev")
        ->type_name("ORIGIN");
  }
};

// Our types, and those of the files.
Result<LcmDefinitions> LoadDefinitions(const std::vector<std::string>& files) {
  LcmDefinitions definitions;
  if (const Result<> own = definitions.Add(SchemaText()); !own) return Failure(own.error());
  for (const std::string& file : files) {
    std::ifstream in(file);
    std::ostringstream text;
    if (!in || !(text << in.rdbuf())) return Failure(file + ": cannot be read");
    if (const Result<> added = definitions.Add(text.str()); !added)
      return Failure(file + ": " + added.error().text);
  }
  for (const std::string& problem : definitions.Finish()) std::cerr << "warning: " << problem << '\n';
  return definitions;
}

// Passes the messages of the live machine to the viewers.
class FoxgloveSource {
 public:
  FoxgloveSource(const MachineConfig& machine, FoxgloveApp& app) : app_(app) {
    Listen(machine, machine.lcm.url);
    if (machine.lcm.command_url != machine.lcm.url) Listen(machine, machine.lcm.command_url);
  }

  [[nodiscard]] const std::string& problem() const { return problem_; }

  // Processes the received messages.
  void Gather() {
    ReceptionCounts counts;
    for (LcmPort& port : ports_) {
      pollfd waits = {port.FileDescriptor(), POLLIN, 0};
      for (int i = 0; i < kMaxHandles && problem_.empty() && poll(&waits, 1, 0) > 0; ++i) {
        if (!port.Handle(0)) problem_ = "the LCM port failed";
      }
      counts += port.received();
    }
    const std::string lost = reception_.NextLine(counts, clock_.Now(), ports_.front().warning());
    if (!lost.empty()) std::cerr << lost << '\n';
  }

 private:
  void Listen(const MachineConfig& machine, const std::string& url) {
    LcmPort& port = ports_.emplace_back(url, machine.lcm.prefix, machine.machine);
    const auto handler = [this](const std::string& channel, Bytes message) {
      app_.OnMessage(channel, message, clock_.UtcMicroseconds());
    };
    if (problem_.empty()) problem_ = port.problem();
    if (problem_.empty() && !port.Subscribe(kEveryChannel, handler, kQueue))
      problem_ = "cannot subscribe on " + url;
  }

  const SystemClock clock_;
  FoxgloveApp& app_;
  std::list<LcmPort> ports_;
  ReceptionReport reception_;
  std::string problem_;
};

int Serve(const FoxgloveOptions& options, const WebConfig& web, const MachineConfig& machine, const Secret& token,
          const LcmDefinitions& definitions) {
  std::vector<std::string> names = web.names;
  names.push_back(HostName());
  WebAccess access({.names = names, .tls = !web.certificate.empty(), .token_required = !web.token.empty()}, token);
  const SystemClock clock;
  const StopSignal stop;
  Supervision supervision;
  std::optional<FoxgloveSource> source;
  FoxgloveApp app(
      {.clock = &clock,
       .access = &access,
       .definitions = &definitions,
       .name = machine.machine,
       .session_id = Text("%016llx", static_cast<unsigned long long>(NewOrigin(machine.machine).boot_id)),
       .origins = options.origins,
       .max_viewers = options.server.clients,
       .tick =
           [&] {
             supervision.Progress(clock.Now());
             source->Gather();
             return source->problem().empty() && !stop.Requested();
           },
       .problem = [&source] { return source->problem(); }});
  source.emplace(machine, app);
  if (!source->problem().empty()) return Fail(source->problem(), kExitBad);
  const int connections = static_cast<int>(options.server.clients) + kSpareConnections;
  WebServer server({.address = web.bind,
                    .port = web.port,
                    .certificate = web.certificate,
                    .key = web.key,
                    .max_connections = connections,
                    .max_per_address = connections / 2,
                    .subprotocols = FoxgloveApp::Subprotocols(),
                    .longest_frame = FoxgloveApp::kLongestRequest},
                   app);
  if (!server.problem().empty()) return Fail(server.problem(), kExitFailed);
  WebConfig shown = web;
  shown.port = server.port();
  const std::string url = WebUrl(shown, HostName());
  std::cerr << machine.machine << "; Ctrl-C ends it\n";
  static_cast<void>(WriteOut("ws" + url.substr(std::string_view("http").size()) + '\n'));
  supervision.Ready();
  const bool served = server.Run();
  supervision.Stopping();
  if (!source->problem().empty()) return Fail(source->problem(), kExitFailed);
  return served ? kExitDone : Fail("the server's library failed", kExitFailed);
}

int RunFoxglove(const FoxgloveOptions& options) {
  const Result<MachineConfig> machine = options.config.Load();
  if (!machine) return options.config.Fail(machine.error());
  WebConfig web = options.server.Over(machine->web);
  if (!options.server.port) web.port = kDefaultPort;
  const std::vector<ConfigFault> faults = FaultsOf(web);
  for (const ConfigFault& fault : faults) std::cerr << "web: " << fault.key << ": " << fault.text << '\n';
  if (!faults.empty()) return kExitUsage;
  const Result<Secret> token = ReadWebSecrets(web);
  if (!token) return Fail(token.error().text, kExitBad);
  const Result<LcmDefinitions> definitions = LoadDefinitions(options.types);
  if (!definitions) return Fail(definitions.error().text, kExitBad);
  return Serve(options, web, *machine, *token, *definitions);
}

}  // namespace

void AddFoxgloveCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<FoxgloveOptions>();
  CLI::App* command = app.add_subcommand(
      "foxglove", "Serve the live messages to Foxglove, Lichtblick and PlotJuggler; it accepts no commands");
  options->AddTo(*command);
  command->footer(
      "examples:\n"
      "  axlecast foxglove                             then open a connection to ws://localhost:8765 in the "
      "viewer\n"
      "  axlecast foxglove --types camera.lcm          also messages that are not of axlecast\n"
      "  axlecast foxglove --origin https://app.foxglove.dev\n"
      "  axlecast foxglove --bind 0.0.0.0 --tls-cert web.pem --tls-key web.key --token-file web.token\n"
      "Other hosts need TLS and a token, as with axlecast web.\n"
      "exit code: 0 ended by a signal, 1 an input is bad, 2 usage, 4 the address cannot be served");
  command->callback([options, &exit_code] { exit_code = RunFoxglove(*options); });
}

}  // namespace axlecast
