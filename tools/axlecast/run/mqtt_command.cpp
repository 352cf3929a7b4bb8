#include "tools/axlecast/run/subcommands.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <iostream>
#include <memory>

#include "core/messages/json/field.h"
#include "platform/os/process.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/run/mqtt_options.h"
#include "tools/axlecast/run/mqtt_run.h"
#include "tools/mqtt/mqtt_schema.h"

namespace axlecast {
namespace {

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
  if (const std::string problem = ForbidCoreDumps(); !problem.empty()) std::cerr << "warning: " << problem << '\n';
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
  int exit_code = kExitDone;
  std::optional<MachineConfig> machine = options.config.Load(exit_code);
  if (!machine) return exit_code;
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
