#include <algorithm>
#include <axlecast/position_t.hpp>
#include <numbers>

#include "core/base/spelling.h"
#include "core/config/load.h"
#include "core/config/yaml_text.h"

namespace axlecast {
namespace {

constexpr std::int64_t kSlowestBaud = 1'200;
constexpr std::int64_t kFastestBaud = 12'000'000;
constexpr std::int64_t kSlowestBitrate = 10'000;  // CiA 301's slowest; classical CAN ends at 1 Mbit/s
constexpr std::int64_t kFastestBitrate = 1'000'000;
constexpr std::int64_t kFastestClock = 50'000'000;
constexpr std::size_t kLongestInterface = 15;  // IFNAMSIZ without its NUL

// What differs between the kinds of line.
struct LinkWords {
  const char* key;      // that names the line
  const char* example;  // of its value
  const char* suffix;   // of a simulated line
  const char* missing;  // the error without the key
};

LinkWords WordsOf(LinkKind kind) {
  switch (kind) {
    case LinkKind::kCan:
      return {"iface", "can0", ".can",
              "is missing: name the CAN interface (ip -brief link show type can), or set simulate: true"};
    case LinkKind::kSpi:
      return {"spidev", "/dev/spidev0.0", ".spi",
              "is missing: name the SPI device (ls /dev/spidev*), or set simulate: true"};
    case LinkKind::kSerial:
    case LinkKind::kModbus:
      break;
  }
  return {"port", "/dev/ttyUSB0", ".pty",
          "is missing: name the serial port, best by its lasting name (ls -l /dev/serial/by-id/), or set "
          "simulate: true"};
}

bool IsInterface(std::string_view name) {
  return name.size() <= kLongestInterface && name.find_first_of("/ \t:") == std::string_view::npos;
}

void CheckLink(ConfigMap& map, LinkKind kind, const std::string& name) {
  const LinkWords words = WordsOf(kind);
  const bool can = kind == LinkKind::kCan;
  if (name.empty()) {
    map.Error(words.key, words.missing);
  } else if (can ? !IsInterface(name) : !name.starts_with('/')) {
    map.Error(words.key, Quoted(name) + (can ? " is no name of an interface" : " is no absolute path") + ", e.g. " +
                             words.example);
  }
}

void LoadLine(ConfigMap& map, const LineFormat& usual, LinkConfig& link) {
  link.line.baud = map.Integer("baud", usual.baud, kSlowestBaud, kFastestBaud, "baud");
  link.line.parity =
      static_cast<Parity>(map.Choice("parity", {"none", "even", "odd"}, static_cast<std::size_t>(usual.parity)));
  link.line.stop_bits = static_cast<int>(map.Integer("stop_bits", usual.stop_bits, 1, 2, "stop bits"));
  link.echo = map.Bool("echo", false);
  link.pty = map.Bool("pty", false);
}

struct Unit {
  std::string_view name;
  std::int8_t code;
  double per_turn;  // of one turn; 0: the machine's mechanics decide
};
constexpr Unit kUnits[] = {
    {"count", position_t::UNIT_COUNT, 0},
    {"turn", position_t::UNIT_TURN, 1},
    {"rad", position_t::UNIT_RAD, 2 * std::numbers::pi},
    {"deg", position_t::UNIT_DEG, 360},
    {"mm", position_t::UNIT_MM, 0},
    {"m", position_t::UNIT_M, 0},
    {"um", position_t::UNIT_UM, 0},
    {"inch", position_t::UNIT_INCH, 0},
};
constexpr std::size_t kTurn = 1;

// Enough for any axis; keeps counts x ratio exact in a double.
constexpr double kMaxPerTurn = 1e9;
constexpr std::int64_t kMaxTeeth = 1'000'000;
constexpr std::int64_t kMaxDatum = std::int64_t{1} << 52;
constexpr double kMaxPublished = 20'000;

void LoadUnit(ConfigMap& map, DeviceConfig& device) {
  std::vector<std::string_view> names;
  for (const Unit& unit : kUnits) names.push_back(unit.name);
  const Unit& unit = kUnits[map.Choice("unit", names, kTurn)];
  const std::string name(unit.name);
  device.unit = unit.code;
  device.per_turn = unit.per_turn;
  if (unit.code == position_t::UNIT_COUNT) device.per_turn = static_cast<double>(device.settings->counts_per_turn);

  if (device.per_turn > 0) {
    if (map.Has("per_turn")) {
      map.Error("per_turn",
                "unit " + name + " already defines the travel of a turn; for a gear use ratio: \"num:den\"");
    }
  } else if (!map.Has("per_turn")) {
    map.Error("per_turn", "is missing: unit " + name + " needs the travel of one output turn in " + name);
    device.per_turn = 1;
  } else {
    device.per_turn = map.Number("per_turn", 1, 1e-9, kMaxPerTurn, name);
  }
  if (map.Has("modulo")) device.modulo = map.Number("modulo", 0, 1e-9, 1e12, name);
}

void LoadRatio(ConfigMap& map, DeviceConfig& device) {
  if (!map.Has("ratio")) return;
  const std::string text = map.String("ratio", "1:1");
  const std::size_t colon = std::min(text.find(':'), text.size());
  const auto num = ParseInteger(text.substr(0, colon), 1, kMaxTeeth);
  const auto den = ParseInteger(text.substr(std::min(colon + 1, text.size())), 1, kMaxTeeth);
  if (!num || !den) {
    map.Error("ratio", Quoted(text) +
                           " is not \"num:den\" with whole numbers 1 to 1000000 (output turns = shaft turns x num "
                           "/ den), e.g. \"1:10\" for a gear that reduces by 10");
    return;
  }
  device.ratio_num = *num;
  device.ratio_den = *den;
}

void LoadLimits(ConfigMap& map, DeviceConfig& device) {
  ConfigMap limits = map.Map("limits");
  const DeviceSettings& model = *device.settings;
  const auto limit = [&](std::string_view key, double maximum, std::string_view unit) {
    return limits.Has(key) ? limits.Number(key, 0, 1e-3, maximum > 0 ? maximum : 1e9, unit) : 0;
  };
  device.speed_rpm = limit("speed_rpm", model.max_speed_rpm, "rpm (the model's limit)");
  device.accel_rad_s2 = limit("accel_rad_s2", model.max_accel_rad_s2, "rad/s2 (the model's limit)");
  limits.Done();
}

void LoadTurns(ConfigMap& map, DeviceConfig& device) {
  constexpr std::size_t kModulo = 2;
  const std::size_t mode = map.Choice("turns", {"signed", "unsigned", "modulo"}, kModulo);
  device.turns = static_cast<TurnsMode>(mode);
  if (mode != kModulo && device.settings->turns_range == 0) {
    map.Error("turns", "model " + device.settings->model + " counts no turns: leave the key out");
  }
  ConfigMap datum = map.Map("datum");
  if (datum.Has("counts"))
    device.datum_counts = datum.Integer("counts", 0, -kMaxDatum, kMaxDatum, "counts");
  else if (map.Has("datum"))
    map.Error("datum", "needs counts: the position, in counts after direction, that is 0");
  datum.Done();
}

void LoadAxis(ConfigMap& map, DeviceConfig& device) {
  device.direction = map.Choice("direction", {"ccw", "cw"}, 0) == 0 ? 1 : -1;
  LoadUnit(map, device);
  LoadRatio(map, device);
  LoadLimits(map, device);
  LoadTurns(map, device);
}

void LoadRates(ConfigMap& map, const BusConfig& bus, DeviceConfig& device) {
  if (bus.poll_hz > 0) device.publish_hz = std::min(device.publish_hz, bus.poll_hz);
  device.publish_hz = map.Number("publish_hz", device.publish_hz, 1e-3, kMaxPublished, "Hz");
  if (bus.poll_hz > 0 && device.publish_hz > bus.poll_hz) {
    map.Error("publish_hz",
              "is above the bus's poll_hz: at most that many readings a second exist; lower it, or raise poll_hz");
  }
  if (bus.family->has_position) device.block = map.Bool("block", false);
}

}  // namespace

const char* LinkKey(LinkKind kind) { return WordsOf(kind).key; }

LinkConfig LoadLink(ConfigMap map, const Family& family, bool simulate, const std::string& place) {
  LinkConfig link;
  link.port = map.String(LinkKey(family.link), "");
  if (family.link == LinkKind::kCan) {
    link.bitrate = map.Integer("bitrate", family.default_bitrate, kSlowestBitrate, kFastestBitrate, "bit/s");
  } else if (family.link == LinkKind::kSpi) {
    link.clock_hz = map.Integer("clock_hz", 0, 0, kFastestClock, "Hz (0: as device and cable allow)");
  } else {
    LoadLine(map, family.default_line, link);
  }
  if (simulate) {
    link.port = place + WordsOf(family.link).suffix;
  } else {
    CheckLink(map, family.link, link.port);
  }
  map.Done();
  return link;
}

DeviceConfig LoadDevice(const std::string& name, ConfigMap& map, const BusConfig& bus) {
  DeviceConfig device;
  device.name = name;
  device.line = map.line();
  device.config_hash = ConfigHash(map.node());
  device.settings = bus.family->parse(map, bus);
  device.model = device.settings->model;
  if (bus.family->has_position) LoadAxis(map, device);
  LoadRates(map, bus, device);
  device.permit_required = map.Choice("permit", {"required", "not_required"}, 0) == 0;
  std::vector<std::string_view> severities(kSeverityNames.begin(), kSeverityNames.end());
  severities.emplace_back("never");
  device.alarm_stays_from = static_cast<std::uint8_t>(map.Choice("acknowledge", severities, kNoSeverity));
  map.Done();
  return device;
}

}  // namespace axlecast
