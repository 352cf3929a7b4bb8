#include <poll.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <iostream>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include "core/base/result.h"
#include "core/config/machine_config.h"
#include "core/messages/json/field.h"
#include "core/messages/message.h"
#include "platform/net/lcm_port.h"
#include "platform/os/descriptor.h"
#include "platform/os/process.h"
#include "platform/os/secret_file.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/subcommands.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/run/mqtt_intake.h"
#include "tools/axlecast/run/mqtt_process.h"
#include "tools/axlecast/run/sparkplug_run.h"
#include "tools/mqtt/broker_session.h"
#include "tools/mqtt/mqtt_feed.h"
#include "tools/mqtt/mqtt_status.h"
#include "tools/mqtt/topics.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

constexpr MonoNs kLastDeliveries = 5 * kSecond;  // to deliver the queued messages at the end

// The connection from LCM to a broker, from its start to its end. The calling thread reads from LCM and never waits for the
// broker. A second thread sends the messages of the outbox to the broker.
class MqttRun {
 public:
  explicit MqttRun(const MachineConfig& machine)
      : machine_(machine),
        origin_(NewOrigin(machine.machine)),
        outbox_({static_cast<std::size_t>(machine.mqtt.queue_messages),
                 static_cast<std::size_t>(machine.mqtt.queue_bytes)}),
        intake_(
            machine, clock_,
            [this](BrokerMessage message, RetentionClass keeping) { outbox_.Put(std::move(message), keeping); }),
        link_(LinkSettingsOf(machine)),
        session_(
            link_, outbox_,
            {intake_.feed().topics().status(), JsonLine(MqttStatusJson("offline", origin_.boot_id)),
             [this] { return JsonLine(StatusJson("online")); }, [this] { return JsonLine(StatusJson("ended")); }}),
        alarms_(MqttAlarmName(machine), origin_, clock_.Now()) {}

  [[nodiscard]] Result<> Open() {
    SecretFiles secrets;
    const Result<> usable = CheckMqttCredentials(LinkSettingsOf(machine_), secrets);
    return usable ? intake_.Open() : usable;
  }

  // Runs until a signal, or for `seconds` (0: no limit). Fails if LCM fails.
  [[nodiscard]] Result<> Run(double seconds) {
    const StopSignal stop;
    std::thread sender([this] { SendToBroker(); });
    supervision_.Ready();
    Result<> done = intake_.Run(seconds, [this, &stop] {
      supervision_.Progress(clock_.Now());
      ReportEachSecond();
      return !stop.Requested();
    });
    supervision_.Stopping();
    stop_.Set();
    sender.join();
    return done;
  }

  [[nodiscard]] MqttStatus status() const {
    return {.feed = intake_.feed().counts(), .outbox = outbox_.counts(), .broker = session_.status()};
  }
  [[nodiscard]] Json StatusJson(const char* state) const {
    return MqttStatusJson(state, origin_.boot_id, clock_.UtcMicroseconds(), status());
  }

 private:
  void SendToBroker() {
    bool ending = false;
    while (!session_.ended()) {
      const MonoNs next = session_.Step(clock_.Now());
      std::array<pollfd, 3> files = {
          {link_.Waiting(), {stop_.FileDescriptor(), POLLIN, 0}, {outbox_.FileDescriptor(), POLLIN, 0}}};
      if (ending) files[1].fd = -1;
      if (!session_.WantsMore()) files[2].fd = -1;
      static_cast<void>(PollUntil(files, std::min(next, clock_.Now() + kSecond), clock_));
      if (!ending && (files[1].revents & POLLIN) != 0) {
        ending = true;
        session_.End(clock_.Now() + kLastDeliveries);
      }
    }
  }

  void ReportEachSecond() {
    const MonoNs now = clock_.Now();
    if (now < next_report_) return;
    next_report_ = now + kSecond;
    const MqttStatus status = this->status();
    intake_.ReportLosses(now);
    static_cast<void>(Publish(intake_.data(), "ALARM/" + MqttAlarmName(machine_),
                              alarms_.Make(status, now, clock_.UtcMicroseconds())));
    supervision_.Status(MqttStatusLine(status));
    ReportChanges(status.broker);
  }

  void ReportChanges(const BrokerStatus& broker) {
    const bool reconnected = broker.connections != reported_.connections;
    if (reconnected) std::cerr << BrokerText(machine_.mqtt) << ": connected\n";
    if (!broker.problem.empty() && (reconnected || broker.problem != reported_.problem)) {
      std::cerr << BrokerText(machine_.mqtt) << ": " << broker.problem << '\n';
    }
    if (reconnected && reported_.connections > 0) intake_.feed().RepublishStates();
    reported_ = broker;
  }

  const MachineConfig& machine_;
  SystemClock clock_;
  Origin origin_;
  Outbox outbox_;
  MqttIntake intake_;
  MqttProcess link_;
  BrokerSession session_;
  MqttAlarms alarms_;
  Supervision supervision_;
  WakeEvent stop_;
  MonoNs next_report_ = 0;
  BrokerStatus reported_;
};

struct MqttOptions {
  ConfigOption config;
  std::string broker;
  std::string prefix;
  std::string client_id;
  std::string user;
  std::string password_file;
  std::string ca;
  std::string certificate;
  std::string key;
  std::string protocol;
  std::string sparkplug;
  double interval_s = 0;  // 0: the file's
  double deadband = -1;   // < 0: the file's
  bool tls = false;
  bool print = false;
  bool schema = false;
  bool json = false;
  double seconds = 0;

  void AddTo(CLI::App& command) {
    config.AddTo(command, ConfigOption::Form::kPositional);
    command.add_option("--broker", broker, "Connect to this broker instead of the file's; an IPv6 address in []")
        ->type_name("HOST[:PORT]");
    command.add_option("--prefix", prefix, "Use these first levels of every topic")->type_name("TOPIC");
    command.add_option("--client-id", client_id, "Use this MQTT client id; each bridge needs its own")
        ->type_name("ID");
    command.add_option("--user", user, "Sign in as this user")->type_name("NAME");
    command.add_option("--password-file", password_file, "Read its password from a file of mode 0600")
        ->type_name("FILE");
    command.add_flag("--tls", tls, "Use TLS; check the broker's certificate against the system's authorities");
    command.add_option("--ca", ca, "Use TLS; check against these authorities (PEM)")->type_name("FILE");
    command.add_option("--certificate", certificate, "Use TLS with this client certificate (PEM)")
        ->type_name("FILE");
    command.add_option("--key", key, "Key of the client certificate (PEM, mode 0600)")->type_name("FILE");
    command.add_option("--protocol", protocol, "Use this version of MQTT: 5, or 3.1.1 for an older broker")
        ->check(CLI::IsMember({"5", "3.1.1"}))
        ->type_name("VERSION");
    command.add_option("--sparkplug", sparkplug, "Publish as an edge node of Sparkplug B in this group")
        ->type_name("GROUP");
    command.add_option("--interval", interval_s, "Publish at most one position per device in this time")
        ->check(CLI::Range(0.01, 86'400.0))
        ->type_name("S");
    command
        .add_option("--deadband", deadband,
                    "Publish a position only after it moved by more than this, in the device's unit")
        ->check(CLI::Range(0.0, 1e12))
        ->type_name("VALUE");
    command.add_flag("--print,--dry-run", print,
                     "Print the messages instead of publishing them; no broker is needed");
    command.add_flag("--schema", schema, "Print the JSON Schemas of the published messages, and end");
    command.add_option("--seconds", seconds, "End after this time")->check(CLI::Range(0.001, 1e9))->type_name("S");
    command.add_flag("--json", json, "Print one JSON object per line: the messages, and the summary at the end");
  }
};

// "broker.example", "192.0.2.7:1884", "[2001:db8::1]:1883".
bool ReadBroker(std::string_view text, MqttConfig& mqtt) {
  std::string_view port;
  if (text.starts_with('[')) {
    const std::size_t end = text.find(']');
    if (end == std::string_view::npos) return false;
    port = text.substr(end + 1);
    mqtt.host = text.substr(1, end - 1);
  } else {
    const std::size_t colon = std::min(text.find(':'), text.size());
    port = text.substr(colon);
    mqtt.host = text.substr(0, colon);
  }
  mqtt.port = 0;
  if (port.empty()) return true;
  port.remove_prefix(1);
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), mqtt.port);
  return error == std::errc() && end == port.data() + port.size() && mqtt.port >= 1 && mqtt.port <= 65'535;
}

std::string Absolute(const std::string& path) { return std::filesystem::absolute(path).string(); }

void ApplyPace(const MqttOptions& options, PositionPace& pace) {
  if (options.interval_s > 0) {
    pace.interval = static_cast<MonoNs>(std::llround(options.interval_s * 1e9));
    pace.longest = std::max(pace.longest, pace.interval);
  }
  if (options.deadband >= 0) pace.deadband = options.deadband;
}

// Replaces values of the machine's file by those of the command line.
[[nodiscard]] Result<> ApplyMqttOptions(const MqttOptions& options, MqttConfig& mqtt) {
  if (!options.broker.empty() && !ReadBroker(options.broker, mqtt)) {
    return Failure("--broker '" + options.broker + "' is not HOST or HOST:PORT, e.g. broker.example:1883");
  }
  if (!options.prefix.empty()) mqtt.prefix = options.prefix;
  if (!options.client_id.empty()) mqtt.client_id = options.client_id;
  if (!options.user.empty()) mqtt.user = options.user;
  if (!options.password_file.empty()) mqtt.password = {Absolute(options.password_file), "", false};
  const bool needs_tls = options.tls || !options.ca.empty() || !options.certificate.empty() || !options.key.empty();
  if (needs_tls && !mqtt.tls) mqtt.tls.emplace();
  if (!options.ca.empty()) mqtt.tls->ca = Absolute(options.ca);
  if (!options.certificate.empty()) mqtt.tls->certificate = Absolute(options.certificate);
  if (!options.key.empty()) mqtt.tls->key = Absolute(options.key);
  if (!options.protocol.empty()) mqtt.version_5 = options.protocol == "5";
  if (!options.sparkplug.empty() && !mqtt.sparkplug) mqtt.sparkplug.emplace();
  if (!options.sparkplug.empty()) mqtt.sparkplug->group = options.sparkplug;
  ApplyPace(options, mqtt.positions);
  for (auto& [device, pace] : mqtt.devices) ApplyPace(options, pace);
  if (mqtt.host.empty() && options.print) return {};
  if (mqtt.host.empty()) {
    return Failure(
        "no broker: put `mqtt: {host: broker.example}` into the machine's file, or give --broker HOST; --print "
        "needs "
        "none");
  }
  const std::vector<ConfigFault> faults = FaultsOf(mqtt);
  if (faults.empty()) return {};
  return Failure("mqtt." + std::string(faults.front().key) + ": " + faults.front().text);
}

std::string PrintedLine(const BrokerMessage& message, bool as_json) {
  if (!as_json) return message.topic + (message.retain ? " (retained) " : " ") + message.payload + '\n';
  Json line = {{"topic", message.topic}, {"qos", 1}, {"retain", message.retain}};
  line["payload"] = Json::parse(message.payload);
  return JsonLine(line) + '\n';
}

int Print(const MqttOptions& options, const MachineConfig& machine) {
  const SystemClock clock;
  bool printed = false;
  bool reader_gone = false;
  MqttIntake intake(machine, clock, [&](const BrokerMessage& message, RetentionClass) {
    printed = true;
    reader_gone = reader_gone || !WriteOut(PrintedLine(message, options.json));
  });
  if (const Result<> opened = intake.Open(); !opened) return Fail(opened.error().text, kExitFailed);
  const StopSignal stop;
  const Result<> done = intake.Run(options.seconds, [&] { return !reader_gone && !stop.Requested(); });
  if (!done) return Fail(done.error().text, kExitFailed);
  return printed ? kExitDone : Fail("no message was received: is the machine up, on this URL?", kExitNoAnswer);
}

void Warn(const MqttConfig& mqtt) {
  const bool local = mqtt.host == "localhost" || mqtt.host == "::1" || mqtt.host.starts_with("127.");
  if (!mqtt.tls && !mqtt.password.empty() && !local) {
    std::cerr << "warning: without tls the password is sent to " << mqtt.host << " unencrypted\n";
  }
  if (mqtt.password.empty() && (!mqtt.tls || mqtt.tls->key.empty())) return;
  if (const Result<> done = ForbidCoreDumps(); !done) std::cerr << "warning: " << done.error().text << '\n';
}

int Bridge(const MqttOptions& options, const MachineConfig& machine) {
  Warn(machine.mqtt);
  if (machine.mqtt.sparkplug) return RunSparkplug(machine, options.seconds, options.json);
  MqttRun run(machine);
  if (const Result<> opened = run.Open(); !opened) return Fail(opened.error().text, kExitFailed);
  std::cerr << "machine " << machine.machine << " to " << BrokerText(machine.mqtt) << ", topics "
            << machine.mqtt.prefix << '/' << machine.machine << "/...; Ctrl-C ends it\n";
  const Result<> done = run.Run(options.seconds);
  const MqttStatus status = run.status();
  if (options.json) {
    static_cast<void>(WriteOut(JsonLine(run.StatusJson("ended")) + '\n'));
  } else {
    std::cerr << MqttStatusLine(status) << '\n';
  }
  if (!done) return Fail(done.error().text, kExitFailed);
  return status.Lost() + status.outbox.messages > 0 ? kExitLosses : kExitDone;
}

int RunMqtt(const MqttOptions& options) {
  if (options.schema) return WriteOut(MqttSchemas().dump(2) + '\n') ? kExitDone : kExitFailed;
  Result<MachineConfig> machine = options.config.Load();
  if (!machine) return options.config.Fail(machine.error());
  const Result<> applied = ApplyMqttOptions(options, machine->mqtt);
  if (!applied) return Fail(applied.error().text, kExitUsage);
  if (options.print && machine->mqtt.sparkplug) {
    return Fail(
        "--print shows the topics of docs/mqtt.md: leave sparkplug out, or read the broker's topics spBv1.0/#",
        kExitUsage);
  }
  return options.print ? Print(options, *machine) : Bridge(options, *machine);
}

}  // namespace

void AddMqttCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<MqttOptions>();
  CLI::App* command = app.add_subcommand("mqtt", "Publish the machine's messages to an MQTT broker");
  options->AddTo(*command);
  command->footer(
      "examples:\n"
      "  axlecast mqtt machine.yaml                          to the broker of the machine's file (mqtt:)\n"
      "  axlecast mqtt --broker 192.0.2.7 --interval 0.1 --deadband 0.01\n"
      "  axlecast mqtt --broker broker.example:8883 --ca ca.pem --user press3 --password-file mqtt.password\n"
      "  axlecast mqtt --print --seconds 5                   print the messages\n"
      "  axlecast mqtt --schema                              the JSON Schemas, by kind of topic\n"
      "  axlecast mqtt --sparkplug plant                     as an edge node of Sparkplug B\n"
      "No command is accepted from MQTT. Only with Sparkplug it subscribes: to requests for births, and to the "
      "host's state.\n"
      "exit code: 0 the broker has received everything, 1 the machine's file is bad, 2 usage, 3 messages were lost "
      "or "
      "are still queued, 4 failed, 6 no message was received (--print)");
  command->callback([options, &exit_code] { exit_code = RunMqtt(*options); });
}

}  // namespace axlecast
