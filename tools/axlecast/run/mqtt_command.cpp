#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <string_view>

#include "core/base/result.h"
#include "core/config/machine_config.h"
#include "core/messages/json/field.h"
#include "platform/os/process.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/run/mqtt_run.h"
#include "tools/axlecast/run/subcommands.h"
#include "tools/mqtt/topics.h"

namespace axlecast {
namespace {

// What `axlecast mqtt` was asked for.
struct MqttOptions {
  ConfigOption config;
  std::string broker;  // HOST[:PORT]
  std::string prefix;
  std::string client_id;
  std::string user;
  std::string password_file;
  std::string ca;
  std::string certificate;
  std::string key;
  std::string protocol;
  double interval_s = 0;  // 0: the file's
  double deadband = -1;   // < 0: the file's
  bool tls = false;
  bool print = false;
  bool schema = false;
  bool json = false;
  double seconds = 0;

  void AddTo(CLI::App& command);
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

void MqttOptions::AddTo(CLI::App& command) {
  config.AddTo(command, ConfigOption::Form::kPositional);
  command.add_option("--broker", broker, "The broker, instead of the file's; an IPv6 address in []")
      ->type_name("HOST[:PORT]");
  command.add_option("--prefix", prefix, "First levels of every topic")->type_name("TOPIC");
  command.add_option("--client-id", client_id, "Of MQTT; one for each bridge")->type_name("ID");
  command.add_option("--user", user, "Of the broker")->type_name("NAME");
  command.add_option("--password-file", password_file, "Its password, in a file of mode 0600")->type_name("FILE");
  command.add_flag("--tls", tls, "TLS, the broker's certificate checked against the system's authorities");
  command.add_option("--ca", ca, "TLS, checked against these authorities (PEM)")->type_name("FILE");
  command.add_option("--certificate", certificate, "TLS, with this certificate of ours (PEM)")->type_name("FILE");
  command.add_option("--key", key, "Its key (PEM, mode 0600)")->type_name("FILE");
  command.add_option("--protocol", protocol, "Of MQTT: 5, or 3.1.1 for an older broker")
      ->check(CLI::IsMember({"5", "3.1.1"}))
      ->type_name("VERSION");
  command.add_option("--interval", interval_s, "At most one position of a device in so many seconds")
      ->check(CLI::Range(0.01, 86'400.0))
      ->type_name("S");
  command.add_option("--deadband", deadband, "A position that has moved no further waits, in the device's unit")
      ->check(CLI::Range(0.0, 1e12))
      ->type_name("VALUE");
  command.add_flag("--print,--dry-run", print, "Prints what would be published; no broker is needed");
  command.add_flag("--schema", schema, "Prints the JSON Schemas of what is published, and ends");
  command.add_option("--seconds", seconds, "End after so long")->check(CLI::Range(0.001, 1e9))->type_name("S");
  command.add_flag("--json", json, "One JSON object a line: what is printed, and the summary at the end");
}

// Puts what was given over what the machine's file says. Empty, or what is wrong and what would be right.
[[nodiscard]] std::string ApplyMqttOptions(const MqttOptions& options, MqttConfig& mqtt) {
  if (!options.broker.empty() && !ReadBroker(options.broker, mqtt)) {
    return "--broker '" + options.broker + "' is not HOST or HOST:PORT, e.g. broker.example:1883";
  }
  if (!options.prefix.empty()) mqtt.prefix = options.prefix;
  if (!options.client_id.empty()) mqtt.client_id = options.client_id;
  if (!options.user.empty()) mqtt.user = options.user;
  if (!options.password_file.empty()) mqtt.password = {Absolute(options.password_file), "", false};
  const bool wants_tls = options.tls || !options.ca.empty() || !options.certificate.empty() || !options.key.empty();
  if (wants_tls && !mqtt.tls) mqtt.tls.emplace();
  if (!options.ca.empty()) mqtt.tls->ca = Absolute(options.ca);
  if (!options.certificate.empty()) mqtt.tls->certificate = Absolute(options.certificate);
  if (!options.key.empty()) mqtt.tls->key = Absolute(options.key);
  if (!options.protocol.empty()) mqtt.version_5 = options.protocol == "5";
  ApplyPace(options, mqtt.positions);
  for (auto& [device, pace] : mqtt.devices) ApplyPace(options, pace);
  if (mqtt.host.empty() && options.print) return "";
  if (mqtt.host.empty()) {
    return "no broker: put `mqtt: {host: broker.example}` into the machine's file, or give --broker HOST; --print "
           "needs "
           "none";
  }
  const std::vector<ConfigFault> faults = FaultsOf(mqtt);
  return faults.empty() ? "" : "mqtt." + std::string(faults.front().key) + ": " + faults.front().text;
}

using Json = nlohmann::ordered_json;

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
  if (const std::string problem = intake.Open(); !problem.empty()) {
    std::cerr << problem << '\n';
    return kExitFailed;
  }
  const StopSignal stop;
  const MonoNs end =
      options.seconds > 0 ? clock.Now() + static_cast<MonoNs>(std::llround(options.seconds * 1e9)) : kNever;
  if (!intake.Run(end, [&] { return !reader_gone && !stop.Requested(); })) {
    std::cerr << "the LCM port failed\n";
    return kExitFailed;
  }
  if (!printed) std::cerr << "no message came: is the machine up, on this URL?\n";
  return printed ? kExitDone : kExitNoAnswer;
}

void Warn(const MqttConfig& mqtt) {
  const bool local = mqtt.host == "localhost" || mqtt.host == "::1" || mqtt.host.starts_with("127.");
  if (!mqtt.tls && !mqtt.password.empty() && !local) {
    std::cerr << "warning: without tls the password goes to " << mqtt.host << " in clear\n";
  }
  if (mqtt.password.empty() && (!mqtt.tls || mqtt.tls->key.empty())) return;
  if (const Result<> done = ForbidCoreDumps(); !done) std::cerr << "warning: " << done.error().text << '\n';
}

int Carry(const MqttOptions& options, const MachineConfig& machine) {
  Warn(machine.mqtt);
  MqttRun run(machine);
  if (const std::string problem = run.Open(); !problem.empty()) {
    std::cerr << problem << '\n';
    return kExitFailed;
  }
  std::cerr << "machine " << machine.machine << " to " << BrokerText(machine.mqtt) << ", topics "
            << machine.mqtt.prefix << '/' << machine.machine << "/...; Ctrl-C ends it\n";
  const bool good = run.Run(options.seconds);
  const MqttStatus status = run.status();
  if (options.json) {
    static_cast<void>(
        WriteOut(JsonLine(MqttStatusJson("ended", run.boot_id(), SystemClock().UtcMicroseconds(), status)) + '\n'));
  } else {
    std::cerr << MqttStatusLine(status) << '\n';
  }
  if (!good) std::cerr << "the LCM port failed\n";
  if (!good) return kExitFailed;
  return status.Lost() + status.outbox.messages > 0 ? kExitLosses : kExitDone;
}

int RunMqtt(const MqttOptions& options) {
  if (options.schema) return WriteOut(MqttSchemas().dump(2) + '\n') ? kExitDone : kExitFailed;
  Result<MachineConfig> machine = options.config.Load();
  if (!machine) return options.config.Fail(machine.error());
  if (const std::string problem = ApplyMqttOptions(options, machine->mqtt); !problem.empty()) {
    std::cerr << problem << '\n';
    return kExitUsage;
  }
  return options.print ? Print(options, *machine) : Carry(options, *machine);
}

}  // namespace

void AddMqttCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<MqttOptions>();
  CLI::App* command = app.add_subcommand("mqtt", "Publishes the machine's messages to an MQTT broker");
  options->AddTo(*command);
  command->footer(
      "examples:\n"
      "  axlecast mqtt machine.yaml                          to the broker of the file (mqtt:)\n"
      "  axlecast mqtt --broker 192.0.2.7 --interval 0.1 --deadband 0.01\n"
      "  axlecast mqtt --broker broker.example:8883 --ca ca.pem --user press3 --password-file mqtt.password\n"
      "  axlecast mqtt --print --seconds 5                   what would be published\n"
      "  axlecast mqtt --schema                              its JSON Schemas, by kind of topic\n"
      "One way: nothing is subscribed, and no command comes in from MQTT.\n"
      "exit code: 0 the broker has everything, 1 the machine's file is bad, 2 usage, 3 something was lost or still "
      "waited, 4 failed, 6 nothing came (--print)");
  command->callback([options, &exit_code] { exit_code = RunMqtt(*options); });
}

}  // namespace axlecast
