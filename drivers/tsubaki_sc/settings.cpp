#include "drivers/tsubaki_sc/settings.h"

#include <algorithm>

#include "core/base/spelling.h"
#include "core/config/config_map.h"
#include "core/config/machine_config.h"

namespace axlecast::tsubaki_sc {
namespace {

constexpr std::size_t kReadRequest = 8;  // characters
// Beyond the wire's time: the unit's own, which is not documented, and the 16 ms that an adapter's latency timer may
// hold a reply back.
constexpr MonoNs kTimeoutMargin = 90 * kMillisecond;

constexpr std::size_t ReplySize(const Block& block) { return 5 + 2 * std::size_t{block.count}; }

// One exchange of the live data with its pauses, alone on the bus.
MonoNs ExchangeTime(PacingReading reading, const Block& block, bool alone) {
  const MonoNs request = kUnitLine.WireTime(kReadRequest);
  const MonoNs whole = request + kSilentInterval + kUnitLine.WireTime(ReplySize(block));
  switch (reading) {
    case PacingReading::kAfterReply:
      return whole + kCommandPause;
    case PacingReading::kAfterRequest:
      return std::max(request + kCommandPause, whole + kSilentInterval);
    default:
      return whole + (alone ? kCommandPause : kSilentInterval);
  }
}

Pacing PacingOf(PacingReading reading) {
  switch (reading) {
    case PacingReading::kAfterReply:
      return {.after_reply = kCommandPause};
    case PacingReading::kAfterRequest:
      return {.after_request = kCommandPause, .after_reply = kSilentInterval};
    default:
      return {.after_reply = kSilentInterval, .unit_after_reply = kCommandPause};
  }
}

void ParsePlace(const std::string& name, ConfigMap& map, ScSettings& settings) {
  map.CheckName(name);
  SecretPlace place = LoadPlace(map, "/etc/axlecast/gm3.password");
  if (!map.Has("file") && !map.Has("credential")) {
    map.Error("file", "give exactly one of file: (an absolute path, mode 0600) and credential: (systemd's name)");
  }
  map.Done();
  settings.passwords.emplace(name, std::move(place));
}

void ParsePasswords(ConfigMap& device, ScSettings& settings) {
  for (auto& [name, map] : device.Maps("passwords")) ParsePlace(name, map, settings);
  settings.password = device.String("password", "");
  if (!settings.password.empty() && !settings.passwords.contains(settings.password)) {
    device.Error(
        "password",
        "names none of passwords: it is the NAME of one of them, never the password: passwords: {NAME: {file: "
        "/etc/axlecast/gm3.password}}");
    settings.password.clear();
  } else if (settings.password.empty() && !settings.passwords.empty()) {
    device.Error("password", "is missing: name the one of passwords that the unit has now");
  }
  settings.password_format.order =
      device.Choice("endian", {"high", "low"}, 0) == 0 ? CharacterOrder::kHighFirst : CharacterOrder::kLowFirst;
  settings.password_format.padding =
      device.Choice("password_padding", {"nul", "space"}, 0) == 0 ? std::uint8_t{0x00} : std::uint8_t{0x20};
}

}  // namespace

MonoNs LiveCycle(PacingReading reading, std::size_t units) {
  const auto both = [&](bool alone) {
    return ExchangeTime(reading, kAnalog, alone) + ExchangeTime(reading, kStatus, alone);
  };
  if (reading != PacingReading::kPerUnit) return both(false);
  // The pauses of one unit are filled with the exchanges of the others, as far as there are any.
  return std::max(both(false), both(true) / static_cast<MonoNs>(std::max<std::size_t>(units, 1)));
}

std::shared_ptr<const FamilyBus> ParseBusSettings(ConfigMap& map, const BusConfig& bus) {
  auto settings = std::make_shared<ScBus>();
  settings->reading =
      static_cast<PacingReading>(map.Choice("pacing", {"after_reply", "after_request", "per_unit"}, 0));
  settings->pacing = PacingOf(settings->reading);
  const YAML::Node node = map.node();
  if (node.IsMap() && node["devices"].IsDefined() && node["devices"].IsMap()) {
    settings->units = std::max<std::size_t>(node["devices"].size(), 1);
  }
  ConfigMap link = map.Map("link");
  if (bus.link.line.baud != kUnitLine.baud) link.Error("baud", "the unit's rate is fixed: 9600");
  if (bus.link.line.parity != Parity::kEven && !(bus.simulate && bus.link.line.parity == Parity::kNone)) {
    link.Error("parity",
               "the unit's parity is fixed: even; leave the key out (a pty runs without parity by itself)");
  }
  if (bus.link.line.stop_bits != kUnitLine.stop_bits) link.Error("stop_bits", "the unit has 1");
  return settings;
}

std::unique_ptr<DeviceSettings> ParseSettings(ConfigMap& device, const BusConfig& bus) {
  auto settings = std::make_unique<ScSettings>();
  settings->model = "sc_unit";
  device.Require("address", "1 to 16, as set on the unit's DIP switches");
  settings->address = static_cast<std::uint8_t>(device.Integer("address", 1, 1, kLastAddress, "(DIP switches)"));
  settings->motor_control =
      static_cast<MotorControl>(device.Choice("motor_control", {"none", "stop", "start_stop"}, 0));
  ParsePasswords(device, *settings);
  settings->holds_secrets = !settings->passwords.empty();
  if (settings->motor_control != MotorControl::kNone && settings->passwords.empty()) {
    device.Error("motor_control", "needs passwords and password: the unit takes no writes without a login");
  }
  const bool says_log_out = device.Has("log_out");
  settings->log_out =
      device.Bool("log_out", true) && (says_log_out || settings->motor_control == MotorControl::kNone);
  settings->trip_fetch = static_cast<TripFetchMode>(device.Choice("trip_fetch", {"suspend_live", "alternate"}, 0));
  const MonoNs longest = kUnitLine.WireTime(kReadRequest + ReplySize(LogBlock(0, 0))) + kTimeoutMargin;
  settings->timeout = device.Integer("timeout_us", longest / kMicrosecond, 80'000, 2'000'000,
                                     "us; the longest reply takes 61,000 on the wire") *
                      kMicrosecond;
  settings->reply_timeout = settings->timeout;
  const auto& own = static_cast<const ScBus&>(*bus.family_bus);
  settings->wire_time = LiveCycle(own.reading, own.units);
  settings->exchanges = 2;
  return settings;
}

void CheckAddresses(ConfigMap& map, const BusConfig& bus) {
  std::map<int, std::string> taken;
  for (const DeviceConfig& device : bus.devices) {
    const int address = static_cast<const ScSettings&>(*device.settings).address;
    const auto [first, added] = taken.emplace(address, device.name);
    if (!added) {
      map.Map("devices")
          .Named(device.name)
          .Error("address", std::to_string(address) + " is " + first->second +
                                "'s already: two units would answer at once; set another on the DIP switches");
    }
  }
}

}  // namespace axlecast::tsubaki_sc
