#include "tools/axlecast/run/mqtt_options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <string_view>

namespace axlecast {
namespace {

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

}  // namespace

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

std::string ApplyMqttOptions(const MqttOptions& options, MqttConfig& mqtt) {
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
  const std::vector<MqttFault> faults = FaultsOf(mqtt);
  return faults.empty() ? "" : "mqtt." + std::string(faults.front().key) + ": " + faults.front().text;
}

}  // namespace axlecast
