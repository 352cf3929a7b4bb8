#include "tools/axlecast/setup/config_report.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>
#include <optional>

#include "core/base/spelling.h"
#include "core/base/text.h"
#include "core/command/keys.h"
#include "core/config/abbreviations.h"
#include "core/config/hosts.h"
#include "core/config/load.h"
#include "core/messages/enum_names.h"
#include "core/messages/lcm_url.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/program.h"
#include "tools/axlecast/common/subcommands.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/setup/log_rates.h"
#include "tools/axlecast/setup/new_keys.h"

namespace axlecast {
namespace {

// Above it, commands, retries and the silence after a fault take slots from readings.
constexpr double kBusy = 0.9;
// A USB adapter delivers bytes at most once per millisecond (FTDI latency timer at 1 ms).
constexpr double kUsbHz = 1'000;
// Measured: at this rate, each LCM process that only receives uses about a tenth of a core.
constexpr double kManyMessages = 20'000;
constexpr double kDayNs = 86'400e9;
constexpr double kHourNs = 3'600e9;
constexpr double kDaysPerYear = 365.25;
constexpr double kGigabyte = 1'024.0 * 1'024 * 1'024;

using Json = nlohmann::ordered_json;

// Returns the period of a device that sends by itself, else of polling; 0: unknown.
double RefreshUs(const DeviceConfig& device, const BusLoad& load) {
  const MonoNs own = device.settings->own_period;
  if (own > 0) return static_cast<double>(own) / static_cast<double>(kMicrosecond);
  return load.poll_hz > 0 ? 1e6 / load.poll_hz : 0;
}

bool IsUsb(const std::string& port) {
  return port.starts_with("/dev/serial/") || port.starts_with("/dev/ttyUSB") || port.starts_with("/dev/ttyACM");
}

void AddBusWarnings(const BusConfig& bus, std::vector<std::string>& warnings) {
  const BusLoad load = LoadOf(bus);
  const std::string bus_name = "bus " + bus.name + ": ";
  if (bus.poll_hz > 0 && load.utilisation > kBusy) {
    const char* or_bus = bus.devices.size() > 1 ? ", or a second bus," : "";
    warnings.push_back(bus_name +
                       Text("readings take %.0f %% of the wire's time: commands and retries will replace "
                            "readings; poll_hz %.0f or less%s leaves them room",
                            load.utilisation * 100, load.max_hz * kBusy, or_bus));
  }
  if (bus.simulate || !IsUsb(bus.link.port)) return;
  if (bus.poll_hz > kUsbHz) {
    warnings.push_back(bus_name +
                       Text("a USB adapter answers at most about 1000 times a second (latency timer at 1 ms): "
                            "poll_hz %.0f will not be reached",
                            bus.poll_hz));
  }
  if (!bus.link.port.starts_with("/dev/serial/by-id/")) {
    warnings.push_back(bus_name + bus.link.port +
                       " may name another adapter after the next start: use its name in /dev/serial/by-id/");
  }
}

bool SendByThemselves(const BusConfig& bus) {
  return std::all_of(bus.devices.begin(), bus.devices.end(),
                     [](const DeviceConfig& device) { return device.settings->own_period > 0; });
}

// Returns the share of the wire's time that their messages take.
double SentShare(const BusConfig& bus) {
  double share = 0;
  for (const DeviceConfig& device : bus.devices) {
    share += static_cast<double>(device.settings->wire_time) / static_cast<double>(device.settings->own_period);
  }
  return share;
}

bool IsSerial(const BusConfig& bus) {
  return bus.family->link == LinkKind::kSerial || bus.family->link == LinkKind::kModbus;
}

// "8E1"
std::string FormatText(const LineFormat& line) {
  constexpr const char* kParity[] = {"8N", "8E", "8O"};
  return kParity[static_cast<std::size_t>(line.parity)] + std::to_string(line.stop_bits);
}

// "19200 baud 8N1", "250000 bit/s", "200000 Hz, SPI mode 2"
std::string LineText(const BusConfig& bus) {
  if (IsSerial(bus)) return std::to_string(bus.link.line.baud) + " baud " + FormatText(bus.link.line);
  if (bus.family->link == LinkKind::kCan) return std::to_string(bus.link.bitrate) + " bit/s";
  const SpiSettings spi = SpiOf(bus);
  return std::to_string(spi.clock_hz) + " Hz, SPI mode " + std::to_string(spi.mode);
}

// Returns the settings that only this kind of line has.
Json LineJson(const BusConfig& bus) {
  if (IsSerial(bus)) return {{"baud", bus.link.line.baud}, {"format", FormatText(bus.link.line)}};
  if (bus.family->link == LinkKind::kCan) return {{"bitrate", bus.link.bitrate}};
  const SpiSettings spi = SpiOf(bus);
  return {{"clock_hz", spi.clock_hz}, {"spi_mode", spi.mode}};
}

std::string Travel(const DeviceConfig& device) {
  const std::string unit(UnitName(device.unit));
  std::string text = Text("%.12g %s/turn", device.per_turn, unit.c_str());
  if (device.ratio_num != device.ratio_den) {
    text += ", gear " + std::to_string(device.ratio_num) + ':' + std::to_string(device.ratio_den);
  }
  return text;
}

bool HasOwnLimits(const DeviceConfig& device) { return device.speed_rpm > 0 && device.accel_rad_s2 > 0; }

// With narrower limits, more damaged readings are detected.
std::string LimitsText(const DeviceConfig& device) {
  if (HasOwnLimits(device))
    return Text(", at most %.6g rpm and %.6g rad/s2", device.speed_rpm, device.accel_rad_s2);
  return ", limits of the model only: `axlecast hwtest " + device.name + "` proposes its own";
}

std::string BusText(const BusConfig& bus) {
  const BusLoad load = LoadOf(bus);
  std::string text = "bus " + Left(bus.name, 24) + ' ' + Left(std::string(bus.family->name), 10) + ' ' +
                     (bus.simulate ? "simulated" : bus.link.port) + ", " + LineText(bus) + '\n';
  text += SendByThemselves(bus) ? "    sent by the devices" : Text("    polled at %.10g Hz", load.poll_hz);
  if (load.round_us > 0) {
    text += Text(", one round takes %.4g us: %.1f %% of the wire's time, at most %.0f Hz", load.round_us,
                 load.utilisation * 100, load.max_hz);
  }
  text += '\n';
  for (const DeviceConfig& device : bus.devices) {
    text +=
        "    " + Left(device.name, 24) + ' ' + Left(device.model, 12) +
        Text(" refreshed every %.6g us, published at %.4g Hz", RefreshUs(device, load), MessageRate(bus, device)) +
        (bus.family->has_position ? ", " + Travel(device) + LimitsText(device) : "") +
        (device.permit_required ? "" : ", permit not required") + '\n';
  }
  return text;
}

Json DeviceJson(const BusConfig& bus, const DeviceConfig& device, const BusLoad& load) {
  const std::string hash = Text("%016llx", static_cast<unsigned long long>(device.config_hash));
  Json json = {
      {"device", device.name},           {"model", device.model},         {"refresh_us", RefreshUs(device, load)},
      {"publish_hz", device.publish_hz}, {"unit", UnitName(device.unit)}, {"per_turn", device.per_turn},
      {"ratio_num", device.ratio_num},   {"ratio_den", device.ratio_den}, {"config_hash", hash}};
  if (bus.family->has_position) json["own_limits"] = HasOwnLimits(device);
  return json;
}

Json BusJson(const BusConfig& bus) {
  const BusLoad load = LoadOf(bus);
  Json json = {
      {"bus", bus.name}, {"family", bus.family->name}, {"simulate", bus.simulate}, {"port", bus.link.port}};
  json.update(LineJson(bus));
  json.update({{"poll_hz", bus.poll_hz},
               {"round_us", load.round_us > 0 ? Json(load.round_us) : Json()},
               {"most_hz", load.round_us > 0 ? Json(load.max_hz) : Json()},
               {"utilisation", load.round_us > 0 ? Json(load.utilisation) : Json()},
               {"devices", Json::array()}});
  for (const DeviceConfig& device : bus.devices) json["devices"].push_back(DeviceJson(bus, device, load));
  return json;
}

// "45 minutes", "13 hours", "20 days", "3 years"
std::string DurationText(MonoNs time) {
  const double hours = static_cast<double>(time) / kHourNs;
  if (hours < 2) return Text("%.0f minutes", hours * 60);
  if (hours < 48) return Text("%.0f hours", hours);
  const double days = hours / 24;
  return days < 2 * kDaysPerYear ? Text("%.0f days", days) : Text("%.0f years", days / kDaysPerYear);
}

// A log that is deleted by its quota long before the time for which it is kept.
void AddLogWarning(const MachineConfig& machine, const LogConfig& log, std::vector<std::string>& warnings) {
  const std::optional<MonoNs> lasts = QuotaLasts(machine, log);
  if (!lasts || log.keep == 0 || *lasts >= log.keep) return;
  const double needed =
      static_cast<double>(log.quota_bytes) * static_cast<double>(log.keep) / static_cast<double>(*lasts);
  warnings.push_back("recorder log " + log.name + ": its quota of " + FormatSize(log.quota_bytes) + " lasts " +
                     DurationText(*lasts) + " at the rates of this file, less than keep: " + FormatTime(log.keep) +
                     Text("; that needs about %.0f GB, or a lower publish_hz", std::ceil(needed / kGigabyte)));
}

std::string LogText(const MachineConfig& machine, const LogConfig& log) {
  std::string text =
      "    " + Left(log.name, 24) + ' ' +
      (log.channels.empty() ? "all channels"
                            : (log.invert ? "all channels but " : "channels ") + Quoted(log.channels));
  if (!log.trigger.empty()) text += ", around " + Quoted(log.trigger);
  if (log.keep > 0) text += Text(", kept for %.6g days", static_cast<double>(log.keep) / kDayNs);
  if (log.quota_bytes > 0) text += ", at most " + std::to_string(log.quota_bytes >> 20) + " MB";
  if (log.keep == 0 && log.quota_bytes == 0) text += ", never deleted";
  const double rate = LogBytesPerSecond(machine, log);
  if (log.compress) text += Text(", compressed to about 1/%.2g", kCompressionFactor);
  text += Text(", about %.3g kB/s%s", rate / 1e3, log.trigger.empty() ? "" : " while it records");
  if (const auto lasts = QuotaLasts(machine, log)) text += ": the quota lasts " + DurationText(*lasts);
  return text + '\n';
}

std::string RecorderText(const MachineConfig& machine) {
  if (machine.recorder.logs.empty()) return "";
  std::string text = "recorder, into " + LogDirectory(machine) + '\n';
  for (const LogConfig& log : machine.recorder.logs) text += LogText(machine, log);
  return text;
}

Json RecorderJson(const MachineConfig& machine) {
  if (machine.recorder.logs.empty()) return nullptr;
  Json json = {{"directory", LogDirectory(machine)}, {"logs", Json::array()}};
  for (const LogConfig& log : machine.recorder.logs) {
    const std::optional<MonoNs> lasts = QuotaLasts(machine, log);
    json["logs"].push_back({{"name", log.name},
                            {"channels", log.channels},
                            {"invert", log.invert},
                            {"trigger", log.trigger},
                            {"keep_s", static_cast<double>(log.keep) / 1e9},
                            {"quota_bytes", log.quota_bytes},
                            {"compress", log.compress},
                            {"bytes_per_s", std::llround(LogBytesPerSecond(machine, log))},
                            {"quota_lasts_s", lasts ? Json(*lasts / kSecond) : Json()}});
  }
  return json;
}

std::string MqttTopics(const MachineConfig& machine) {
  const MqttConfig& mqtt = machine.mqtt;
  if (!mqtt.sparkplug) return mqtt.prefix + '/' + machine.machine;
  const std::string& node = mqtt.sparkplug->node.empty() ? machine.machine : mqtt.sparkplug->node;
  return "spBv1.0/" + mqtt.sparkplug->group + "/+/" + node;
}

std::string MqttText(const MachineConfig& machine) {
  const MqttConfig& mqtt = machine.mqtt;
  if (mqtt.host.empty()) return "";
  return "mqtt, to " + BrokerText(mqtt) + (mqtt.tls ? " with TLS" : " without TLS") + ", topics " +
         MqttTopics(machine) + "/...\n";
}

std::string ShipText(const MachineConfig& machine) {
  const ShipConfig& ship = machine.ship;
  if (ship.database.empty()) return "";
  std::string text = "ship, to " + ship.database + ", " + (ship.newest_first ? "newest" : "oldest") + " logs first";
  if (ship.bandwidth > 0) text += ", waiting logs at " + FormatSize(ship.bandwidth) + " a second";
  if (!ship.metrics.empty()) text += ", metrics on " + ship.metrics;
  return text + '\n';
}

Json ShipJson(const MachineConfig& machine) {
  const ShipConfig& ship = machine.ship;
  if (ship.database.empty()) return nullptr;
  return {{"database", ship.database},
          {"order", ship.newest_first ? "newest_first" : "oldest_first"},
          {"bandwidth", ship.bandwidth}};
}

std::string TimeText(const MachineConfig& machine) {
  const TimeConfig& time = machine.time;
  if (time.root.empty()) return "";
  return "time base, root " + time.root + " at " + time.address + ", UDP port " + std::to_string(time.port) + '\n';
}

Json TimeJson(const MachineConfig& machine) {
  const TimeConfig& time = machine.time;
  if (time.root.empty()) return nullptr;
  return {{"root", time.root}, {"address", time.address}, {"port", time.port}};
}

Json MqttJson(const MachineConfig& machine) {
  const MqttConfig& mqtt = machine.mqtt;
  if (mqtt.host.empty()) return nullptr;
  return {{"broker", BrokerText(mqtt)}, {"tls", mqtt.tls.has_value()}, {"topics", MqttTopics(machine)}};
}

std::string PlaceText(const SecretPlace& place) {
  if (!place.file.empty()) return "secret in " + place.file;
  if (!place.credential.empty()) return "secret in credential " + place.credential;
  return "secret not on this host";
}

std::string OwnText(const std::string& what, const OwnKey& own, const std::string& without) {
  return "    " + Left(what, 10) + ' ' +
         (own.public_key ? KeyIdText(*own.public_key) + "  " + PlaceText(own.place) : "no key: " + without) + '\n';
}

std::string GrantText(const KeyGrant& grant) {
  return "    key " + Left(grant.name, 24) + ' ' + KeyIdText(grant.key) + "  " +
         Left(std::string(RoleName(grant.role)), 10) + " devices " +
         (grant.devices.empty() ? "all" : Listed(grant.devices)) + "; operations " +
         (grant.operations.empty() ? "all of the role" : Listed(grant.operations)) +
         (grant.place.empty() ? "" : "; " + PlaceText(grant.place)) + '\n';
}

Json PlaceJson(const SecretPlace& place) {
  return {{"file", place.file.empty() ? Json() : Json(place.file)},
          {"credential", place.credential.empty() ? Json() : Json(place.credential)}};
}

Json OwnJson(const OwnKey& own) {
  if (!own.public_key) return nullptr;
  Json json = {{"public", KeyText(*own.public_key)}, {"key_id", KeyIdText(*own.public_key)}};
  json.update(PlaceJson(own.place));
  return json;
}

Json GrantJson(const KeyGrant& grant) {
  Json json = {{"name", grant.name},           {"public", KeyText(grant.key)}, {"key_id", KeyIdText(grant.key)},
               {"role", RoleName(grant.role)}, {"devices", grant.devices},     {"operations", grant.operations}};
  json.update(PlaceJson(grant.place));
  return json;
}

// Returns the warning for a machine whose commands need no signature.
std::string UnsignedWarning(const MachineConfig& machine) {
  if (const auto url = ParseLcmUrl(machine.lcm.command_url); url && url->ttl > 0) {
    return "bridge.unsigned_commands is allow and lcm.command_url leaves this host (ttl): anybody on the network "
           "may "
           "command this machine; set ttl=0, or refuse them (docs/keys.md)";
  }
  return "bridge.unsigned_commands is allow: every program on this host may command this machine; refuse them, "
         "with "
         "keys for those who may (docs/keys.md)";
}

}  // namespace

BusLoad LoadOf(const BusConfig& bus) {
  BusLoad load;
  load.round_us = static_cast<double>(RoundTime(bus)) / static_cast<double>(kMicrosecond);
  if (load.round_us > 0) load.max_hz = 1e6 / load.round_us;
  load.poll_hz = bus.poll_hz > 0 ? bus.poll_hz : load.max_hz;
  if (load.max_hz > 0) load.utilisation = load.poll_hz / load.max_hz;
  if (SendByThemselves(bus)) load.utilisation = SentShare(bus);
  return load;
}

std::vector<std::string> ConfigWarnings(const MachineConfig& machine) {
  std::vector<std::string> warnings;
  for (const BusConfig& bus : machine.buses) AddBusWarnings(bus, warnings);
  if (const double messages = MessageRate(machine); messages > kManyMessages) {
    warnings.push_back(Text(
        "%.0f messages a second: every LCM process on the port receives all of them; lower publish_hz", messages));
  }
  for (const LogConfig& log : machine.recorder.logs) AddLogWarning(machine, log, warnings);
  for (std::string& warning : KeyWarnings(machine)) warnings.push_back(std::move(warning));
  return warnings;
}

std::vector<std::string> IncludedFiles(const MachineConfig& machine) {
  std::vector<std::string> files;
  for (std::size_t i = 1; i < machine.sources.size(); ++i) files.push_back(machine.sources[i].file);
  return files;
}

std::string ConfigText(const MachineConfig& machine) {
  std::string text = "machine " + machine.machine + "\n    data     " + machine.lcm.url + "\n    commands " +
                     machine.lcm.command_url + '\n';
  for (const std::string& file : IncludedFiles(machine)) text += "    includes " + file + '\n';
  for (const BusConfig& bus : machine.buses) text += BusText(bus);
  text += Text("%.0f POSITION and MOTOR messages a second at most\n", MessageRate(machine));
  return text + RecorderText(machine) + MqttText(machine) + ShipText(machine) + TimeText(machine) +
         KeysText(machine);
}

Json ConfigJson(const std::string& file, const MachineConfig* machine, const ConfigErrors& errors) {
  Json json = {{"file", file}, {"ok", errors.empty()}, {"errors", Json::array()}, {"warnings", Json::array()}};
  for (const ConfigError& error : errors.list()) {
    json["errors"].push_back({{"line", error.line > 0 ? Json(error.line) : Json()},
                              {"column", error.column > 0 ? Json(error.column) : Json()},
                              {"text", error.text},
                              {"file", error.file.empty() ? file : error.file}});
  }
  json["machine"] = nullptr;
  if (machine == nullptr) return json;
  json["included"] = IncludedFiles(*machine);
  for (const std::string& warning : ConfigWarnings(*machine)) json["warnings"].push_back(warning);
  json["machine"] = machine->machine;
  json["buses"] = Json::array();
  for (const BusConfig& bus : machine->buses) json["buses"].push_back(BusJson(bus));
  json["recorder"] = RecorderJson(*machine);
  json["mqtt"] = MqttJson(*machine);
  json["ship"] = ShipJson(*machine);
  json["time"] = TimeJson(*machine);
  json["bridge"] = KeysJson(*machine);
  return json;
}

std::vector<std::string> KeyWarnings(const MachineConfig& machine) {
  const BridgeConfig& bridge = machine.bridge;
  if (bridge.allow_unsigned) return {UnsignedWarning(machine)};
  if (bridge.keys.empty()) {
    return {
        "nobody can command this machine: bridge.keys contains no key, and unsigned commands are refused; axlecast "
        "keygen --machine " +
        machine.machine + " makes the first keys (docs/keys.md)"};
  }
  std::vector<std::string> warnings;
  if (!bridge.bridge.public_key) {
    warnings.push_back(
        "bridge.key is missing: the drivers execute nothing, because unsigned commands are refused; axlecast "
        "keygen makes one (docs/keys.md)");
  } else if (!bridge.drivers.public_key) {
    warnings.push_back(
        "bridge.drivers is missing: the bridge accepts every message that claims to be from a driver; axlecast "
        "keygen makes a key for them (docs/keys.md)");
  }
  return warnings;
}

std::string KeysText(const MachineConfig& machine) {
  const BridgeConfig& bridge = machine.bridge;
  const std::string unchecked = bridge.allow_unsigned ? "anybody is believed" : "nothing is obeyed";
  std::string text = "bridge\n    unsigned   " + std::string(bridge.allow_unsigned ? "allowed" : "refused") +
                     "\n    journal    " + JournalFile(machine) + '\n';
  text += OwnText("bridge", bridge.bridge, unchecked);
  text += OwnText("drivers", bridge.drivers, "anybody is believed");
  for (const KeyGrant& grant : bridge.keys) text += GrantText(grant);
  return text;
}

Json KeysJson(const MachineConfig& machine) {
  const BridgeConfig& bridge = machine.bridge;
  Json json = {{"unsigned_commands", bridge.allow_unsigned ? "allow" : "refuse"},
               {"journal", JournalFile(machine)},
               {"key", OwnJson(bridge.bridge)},
               {"drivers", OwnJson(bridge.drivers)},
               {"keys", Json::array()}};
  for (const KeyGrant& grant : bridge.keys) json["keys"].push_back(GrantJson(grant));
  return json;
}

namespace {

struct CheckOptions {
  ConfigOption config;
  std::string host;
  bool json = false;
  std::string list;
  bool keys = false;
  bool expand = false;
};

// Checks the keys under `simulate`: they belong to the family, and its simulator checks them.
void CheckSimulators(const MachineConfig& machine, ConfigErrors& errors) {
  SimulatorMaker maker(machine, errors);
  for (const BusConfig& bus : machine.buses) {
    if (bus.simulate) static_cast<void>(maker.Make(bus));
  }
}

// Formats one name per line, for scripts: completion and the generator of systemd units.
std::string Names(const MachineConfig& machine, const std::string& list) {
  std::string lines;
  for (const std::string& name :
       list == "units" ? MachineUnits(machine) : MachineNames(machine, list == "devices")) {
    lines += name + '\n';
  }
  return lines;
}

int CheckConfig(const CheckOptions& options) {
  const std::string file = options.config.File();
  if (file.empty()) return options.config.Fail(options.config.Load().error());
  ConfigErrors errors(file);
  const std::optional<MachineConfig> machine = LoadConfig(file, errors);
  if (machine) CheckSimulators(*machine, errors);
  const bool good = machine && errors.empty();
  if (good && options.expand) {
    std::cout << YamlText(ExpandAbbreviations(ReadAgain(*machine, errors).root, errors));
  } else if (good && options.list == "units") {
    const Result<MachineConfig> part = PartOn(*machine, ThisHost(options.host));
    if (!part) return Fail(part.error().text, kExitBad);
    std::cout << Names(*part, options.list);
  } else if (good && !options.list.empty()) {
    std::cout << Names(*machine, options.list);
  } else if (good && options.keys) {
    std::cout << (options.json ? ConfigKeysJson(errors.keys()).dump() + '\n' : ConfigKeysText(errors.keys()));
  } else if (options.json) {
    const auto json = ConfigJson(file, good ? &*machine : nullptr, errors);
    std::cout << json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) << '\n';
  } else if (good) {
    std::cout << file << ": good\n" << ConfigText(*machine);
    for (const std::string& warning : ConfigWarnings(*machine)) std::cout << "warning: " << warning << '\n';
  } else {
    const std::size_t count = errors.list().size();
    std::cerr << errors.Text() << file << ": " << count << (count == 1 ? " error\n" : " errors\n");
  }
  return good ? kExitDone : kExitBad;
}

}  // namespace

void AddCheckConfigCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<CheckOptions>();
  CLI::App* command = app.add_subcommand(
      "check-config",
      "Check a machine's file; show refresh times, the utilisation of each bus, and who may command");
  options->config.AddTo(*command, ConfigOption::Form::kPositional);
  CLI::Option* list =
      command
          ->add_option("--list", options->list,
                       "Only print these names, one per line; units: the systemd units of the machine")
          ->check(CLI::IsMember({"buses", "devices", "units"}));
  AddHostOption(*command, options->host);
  command
      ->add_flag("--json", options->json,
                 "Print one JSON object: file, ok, errors, warnings, machine, buses, bridge")
      ->excludes(list);
  command
      ->add_flag("--keys", options->keys,
                 "List every key that such a file may have, with its range and default, instead of the report")
      ->excludes(list);
  command
      ->add_flag(
          "--expand", options->expand,
          "Print the file with its included files, defaults, merge keys and ranges replaced, instead of the report")
      ->excludes(list)
      ->excludes("--json")
      ->excludes("--keys");
  command->footer(
      "examples:\n"
      "  axlecast check-config config/demo.yaml\n"
      "  axlecast check-config --expand machine.yaml > expanded.yaml\n"
      "  axlecast check-config --keys drivers/ssi/example.yaml | grep simulate\n"
      "  axlecast check-config --json machine.yaml | jq '.errors[].text'\n"
      "  axlecast check-config --list devices\n"
      "Exit code 0: good, perhaps with warnings, 1: errors. Every key: docs/configuration.md");
  command->callback([options, &exit_code] { exit_code = CheckConfig(*options); });
}

}  // namespace axlecast
