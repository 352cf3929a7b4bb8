#include "tools/axlecast/setup/config_report.h"

#include <cstdio>

#include "core/base/spelling.h"
#include "core/base/text.h"
#include "core/command/keys.h"
#include "core/config/machine_config.h"
#include "core/messages/enum_names.h"
#include "core/messages/lcm_url.h"
#include "tools/axlecast/setup/new_keys.h"

namespace axlecast {
namespace {

// Beyond it commands, retries and the silence after a fault have to take slots from readings.
constexpr double kBusy = 0.9;
// A USB adapter hands bytes over once a millisecond at best (FTDI latency timer at 1 ms).
constexpr double kUsbHz = 1'000;
// Measured: here each LCM process that only listens in costs about a tenth of a core.
constexpr double kManyMessages = 20'000;
constexpr double kDayNs = 86'400e9;

using Json = nlohmann::ordered_json;

std::string Format(const char* format, double value) {
  char text[48];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

// As it sends by itself, or as it is asked; 0: not known.
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
    warnings.push_back(bus_name + "readings take " + Format("%.0f", load.utilisation * 100) +
                       " % of the wire's time: commands and retries will cost readings; poll_hz " +
                       Format("%.0f", load.most_hz * kBusy) + " or less" +
                       (bus.devices.size() > 1 ? ", or a second bus, leaves them room" : " leaves them room"));
  }
  if (bus.simulate || !IsUsb(bus.link.port)) return;
  if (bus.poll_hz > kUsbHz) {
    warnings.push_back(bus_name +
                       "a USB adapter answers at most about 1000 times a second (latency timer at 1 ms): " +
                       "poll_hz " + Format("%.0f", bus.poll_hz) + " will not be reached");
  }
  if (!bus.link.port.starts_with("/dev/serial/by-id/")) {
    warnings.push_back(bus_name + bus.link.port +
                       " may name another adapter after the next start: use its name in "
                       "/dev/serial/by-id/");
  }
}

bool SendByThemselves(const BusConfig& bus) {
  return std::all_of(bus.devices.begin(), bus.devices.end(),
                     [](const DeviceConfig& device) { return device.settings->own_period > 0; });
}

// Share of the wire's time that they take.
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

// What of the line only its kind has.
Json LineJson(const BusConfig& bus) {
  if (IsSerial(bus)) return {{"baud", bus.link.line.baud}, {"format", FormatText(bus.link.line)}};
  if (bus.family->link == LinkKind::kCan) return {{"bitrate", bus.link.bitrate}};
  const SpiSettings spi = SpiOf(bus);
  return {{"clock_hz", spi.clock_hz}, {"spi_mode", spi.mode}};
}

std::string Travel(const DeviceConfig& device) {
  std::string text = Format("%.12g", device.per_turn) + ' ' + std::string(UnitName(device.unit)) + "/turn";
  if (device.ratio_num != device.ratio_den) {
    text += ", gear " + std::to_string(device.ratio_num) + ':' + std::to_string(device.ratio_den);
  }
  return text;
}

bool HasOwnLimits(const DeviceConfig& device) { return device.speed_rpm > 0 && device.accel_rad_s2 > 0; }

// The narrower the limits, the more damaged readings are recognised.
std::string LimitsText(const DeviceConfig& device) {
  if (!HasOwnLimits(device))
    return ", limits of the model only: `axlecast hwtest " + device.name + "` proposes its own";
  return ", at most " + Format("%.6g", device.speed_rpm) + " rpm and " + Format("%.6g", device.accel_rad_s2) +
         " rad/s2";
}

std::string BusText(const BusConfig& bus) {
  const BusLoad load = LoadOf(bus);
  std::string text = "bus " + Left(bus.name, 24) + ' ' + Left(std::string(bus.family->name), 10) + ' ' +
                     (bus.simulate ? "simulated" : bus.link.port) + ", " + LineText(bus) + '\n';
  text +=
      SendByThemselves(bus) ? "    sent by the devices" : "    polled at " + Format("%.10g", load.poll_hz) + " Hz";
  if (load.round_us > 0) {
    text += ", one round takes " + Format("%.4g", load.round_us) +
            " us: " + Format("%.1f", load.utilisation * 100) + " % of the wire's time, at most " +
            Format("%.0f", load.most_hz) + " Hz";
  }
  text += '\n';
  for (const DeviceConfig& device : bus.devices) {
    text += "    " + Left(device.name, 24) + ' ' + Left(device.model, 12) + " refreshed every " +
            Format("%.6g", RefreshUs(device, load)) + " us, published at " +
            Format("%.4g", MessageRate(bus, device)) + " Hz" +
            (bus.family->has_position ? ", " + Travel(device) + LimitsText(device) : "") +
            (device.permit_required ? "" : ", permit not required") + '\n';
  }
  return text;
}

Json DeviceJson(const BusConfig& bus, const DeviceConfig& device, const BusLoad& load) {
  char hash[20];
  std::snprintf(hash, sizeof hash, "%016llx", static_cast<unsigned long long>(device.config_hash));
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
               {"most_hz", load.round_us > 0 ? Json(load.most_hz) : Json()},
               {"utilisation", load.round_us > 0 ? Json(load.utilisation) : Json()},
               {"devices", Json::array()}});
  for (const DeviceConfig& device : bus.devices) json["devices"].push_back(DeviceJson(bus, device, load));
  return json;
}

std::string LogText(const LogConfig& log) {
  std::string text =
      "    " + Left(log.name, 24) + ' ' +
      (log.channels.empty() ? "all channels"
                            : (log.invert ? "all channels but " : "channels ") + Quoted(log.channels));
  if (!log.trigger.empty()) text += ", around " + Quoted(log.trigger);
  if (log.keep > 0) text += ", kept for " + Format("%.6g", static_cast<double>(log.keep) / kDayNs) + " days";
  if (log.quota_bytes > 0) text += ", at most " + std::to_string(log.quota_bytes >> 20) + " MB";
  if (log.keep == 0 && log.quota_bytes == 0) text += ", never deleted";
  return text + '\n';
}

std::string RecorderText(const MachineConfig& machine) {
  if (machine.recorder.logs.empty()) return "";
  std::string text = "recorder, into " + LogDirectory(machine) + '\n';
  for (const LogConfig& log : machine.recorder.logs) text += LogText(log);
  return text;
}

Json RecorderJson(const MachineConfig& machine) {
  if (machine.recorder.logs.empty()) return nullptr;
  Json json = {{"directory", LogDirectory(machine)}, {"logs", Json::array()}};
  for (const LogConfig& log : machine.recorder.logs) {
    json["logs"].push_back({{"name", log.name},
                            {"channels", log.channels},
                            {"invert", log.invert},
                            {"trigger", log.trigger},
                            {"keep_s", static_cast<double>(log.keep) / 1e9},
                            {"quota_bytes", log.quota_bytes}});
  }
  return json;
}

std::string MqttText(const MachineConfig& machine) {
  const MqttConfig& mqtt = machine.mqtt;
  if (mqtt.host.empty()) return "";
  return "mqtt, to " + BrokerText(mqtt) + (mqtt.tls ? " with TLS" : " without TLS") + ", topics " + mqtt.prefix +
         '/' + machine.machine + "/...\n";
}

Json MqttJson(const MachineConfig& machine) {
  const MqttConfig& mqtt = machine.mqtt;
  if (mqtt.host.empty()) return nullptr;
  return {
      {"broker", BrokerText(mqtt)}, {"tls", mqtt.tls.has_value()}, {"topics", mqtt.prefix + '/' + machine.machine}};
}

using Json = nlohmann::ordered_json;

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

// Where commands need no signature.
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
  if (load.round_us > 0) load.most_hz = 1e6 / load.round_us;
  load.poll_hz = bus.poll_hz > 0 ? bus.poll_hz : load.most_hz;
  if (load.most_hz > 0) load.utilisation = load.poll_hz / load.most_hz;
  if (SendByThemselves(bus)) load.utilisation = SentShare(bus);
  return load;
}

std::vector<std::string> ConfigWarnings(const MachineConfig& machine) {
  std::vector<std::string> warnings;
  for (const BusConfig& bus : machine.buses) AddBusWarnings(bus, warnings);
  if (const double messages = MessageRate(machine); messages > kManyMessages) {
    warnings.push_back(Format("%.0f", messages) +
                       " messages a second: every LCM process on the port receives all of them; lower publish_hz");
  }
  for (std::string& warning : KeyWarnings(machine)) warnings.push_back(std::move(warning));
  return warnings;
}

std::string ConfigText(const MachineConfig& machine) {
  std::string text = "machine " + machine.machine + "\n    data     " + machine.lcm.url + "\n    commands " +
                     machine.lcm.command_url + '\n';
  for (const BusConfig& bus : machine.buses) text += BusText(bus);
  text += Format("%.0f", MessageRate(machine)) + " POSITION and MOTOR messages a second at most\n";
  return text + RecorderText(machine) + MqttText(machine) + KeysText(machine);
}

Json ConfigJson(const std::string& file, const MachineConfig* machine, const ConfigErrors& errors) {
  Json json = {{"file", file}, {"ok", errors.empty()}, {"errors", Json::array()}, {"warnings", Json::array()}};
  for (const ConfigError& error : errors.list()) {
    json["errors"].push_back({{"line", error.line > 0 ? Json(error.line) : Json()},
                              {"column", error.column > 0 ? Json(error.column) : Json()},
                              {"text", error.text}});
  }
  json["machine"] = nullptr;
  if (machine == nullptr) return json;
  for (const std::string& warning : ConfigWarnings(*machine)) json["warnings"].push_back(warning);
  json["machine"] = machine->machine;
  json["buses"] = Json::array();
  for (const BusConfig& bus : machine->buses) json["buses"].push_back(BusJson(bus));
  json["recorder"] = RecorderJson(*machine);
  json["mqtt"] = MqttJson(*machine);
  json["bridge"] = KeysJson(*machine);
  return json;
}

std::vector<std::string> KeyWarnings(const MachineConfig& machine) {
  const BridgeConfig& bridge = machine.bridge;
  if (bridge.allow_unsigned) return {UnsignedWarning(machine)};
  if (bridge.keys.empty()) {
    return {
        "nobody can command this machine: bridge.keys names no key, and unsigned commands are refused; axlecast "
        "keygen --machine " +
        machine.machine + " makes the first keys (docs/keys.md)"};
  }
  std::vector<std::string> warnings;
  if (!bridge.bridge.public_key) {
    warnings.push_back(
        "bridge.key is missing: the drivers obey nothing, because unsigned orders are refused; axlecast "
        "keygen makes one (docs/keys.md)");
  } else if (!bridge.drivers.public_key) {
    warnings.push_back(
        "bridge.drivers is missing: the bridge believes whoever says that he is a driver; axlecast "
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

}  // namespace axlecast
