#include "drivers/saa_serial/settings.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <map>
#include <string>

#include "core/config/config_map.h"
#include "core/device/operation.h"
#include "drivers/saa/data_sheet.h"

namespace axlecast::saa_serial {

namespace {

// Above the 16 ms that a USB adapter's latency timer holds a reply back by default.
constexpr std::int64_t kDefaultTimeoutUs = 20'000;
// Above the 1 ms to which that timer should be set.
constexpr std::int64_t kDefaultHeldUs = 2'000;
constexpr std::int64_t kDefaultSettleMs = 100;
// X of BX and CX; what is above is a whole command byte. FF begins data frames.
constexpr std::int64_t kLargestX = 15;
constexpr std::int64_t kLargestCommand = 0xFE;
constexpr const char* kCommandRange = "(X of the command, 0 to 15, or the whole byte)";

std::uint8_t Command(std::int64_t value, std::uint8_t base) {
  return static_cast<std::uint8_t>(value <= kLargestX ? base | value : value);
}

void ParseTiming(ConfigMap& map, const BusConfig& bus, SaaBus& into) {
  if (into.mode != Mode::kTiming) {
    if (map.Has("refresh_hz")) map.Error("refresh_hz", "is of mode timing only: leave it out, or set poll_hz");
    return;
  }
  if (!map.Has("refresh_hz")) {
    map.Error("refresh_hz", "is missing: the rate at which the encoder sends by itself, as ordered from the maker");
  }
  const double hz = map.Number("refresh_hz", 1'000, 0.1, 50'000, "Hz");
  into.refresh = std::llround(1e9 / hz);
  if (bus.poll_hz > 0) map.Error("poll_hz", "has no meaning in mode timing: the encoder sends at refresh_hz");
}

void ParseAddress(ConfigMap& device, const SaaBus& bus, SaaSettings& settings) {
  if (bus.mode != Mode::kBus) {
    for (const char* key : {"address", "reply_header", "zero_command"}) {
      if (device.Has(key)) device.Error(key, "is of mode bus only: leave it out");
    }
    return;
  }
  if (!device.Has("address")) {
    device.Error("address", "is missing: X of the encoder's control command BC AA BX, or the whole byte BX");
  }
  const std::int64_t address = device.Integer("address", 1, 0, kLargestCommand, kCommandRange);
  settings.format.address = Command(address, kControlCommand);
  const std::size_t header = device.Choice("reply_header", {"either", "address", "81"}, 0);
  settings.format.header = static_cast<ReplyHeader>(header);
  if (!bus.zero_clearing) {
    if (device.Has("zero_command")) device.Error("zero_command", "needs zero_clearing: true at the bus");
    return;
  }
  const bool usual = (settings.format.address & 0xF0U) == kControlCommand;
  if (!usual && !device.Has("zero_command")) {
    device.Error("zero_command", "is missing: with an address that is no BX the manual names no CX for it");
  }
  const std::int64_t x =
      device.Integer("zero_command", settings.format.address & 0xF, 0, kLargestCommand, kCommandRange);
  settings.zero_command = Command(x, kZeroCommand);
}

void ParseTimes(ConfigMap& device, const SaaBus& bus, SaaSettings& settings) {
  const auto microseconds = [&](const char* key, std::int64_t usual, const char* unit) {
    return device.Integer(key, usual, 0, 1'000'000, unit) * kMicrosecond;
  };
  if (bus.mode == Mode::kTiming) {
    settings.processing = microseconds("processing_us", std::max<std::int64_t>(1, bus.refresh / kMicrosecond),
                                       "us, from sampling to the frame's first bit");
    settings.latency = microseconds("latency_us", kDefaultHeldUs, "us, longer than the adapter's latency timer");
    settings.reply_timeout = std::max(settings.latency, kMicrosecond);
  } else {
    const char* longer = "us, longer than the adapter's latency timer";
    settings.timeout = device.Integer("timeout_us", kDefaultTimeoutUs, 100, 1'000'000, longer) * kMicrosecond;
    settings.reply_timeout = settings.timeout;
    settings.silence = device.Integer("silence_us", kDefaultHeldUs, 50, 1'000'000, longer) * kMicrosecond;
  }
  settings.zero_settle = device.Integer("zero_settle_ms", kDefaultSettleMs, 1, 10'000, "ms") * kMillisecond;
}

// Each command byte may be one unit's alone: a request for a position that is another unit's CX would zero that.
void CheckCommands(ConfigMap& map, const BusConfig& bus) {
  std::map<std::uint8_t, std::string> taken;
  const auto take = [&](std::uint8_t command, const std::string& whose) {
    const auto [first, added] = taken.emplace(command, whose);
    if (added) return;
    map.Error("devices", "BC AA " + HexText({&command, 1}) + " is " + whose + " and " + first->second +
                             ": every command byte of a bus must be one encoder's alone");
  };
  for (const DeviceConfig& device : bus.devices) {
    const SaaSettings& settings = Own(device);
    take(settings.format.address, "the control command of " + device.name);
    if (settings.zero_command) take(*settings.zero_command, "the zero clearing command of " + device.name);
  }
}

// ---- lines beside the bus ----

// "T2 >= 10us" (5.1.3); the manual gives none for CLR, and no upper bound for either.
constexpr std::int64_t kMinLowUs = 10;
constexpr std::int64_t kMaxLowUs = 1'000'000;
constexpr std::int64_t kClkLowUs = 20;
constexpr std::int64_t kClrLowUs = 1'000;

bool IsModemLine(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  constexpr std::array<std::string_view, 2> kNames = {"rts", "dtr"};
  return std::find(kNames.begin(), kNames.end(), text) != kNames.end();
}

// "clr: rts", or {line: rts}.
bool NamesModemLine(const YAML::Node& node) {
  if (node.IsScalar()) return IsModemLine(node.Scalar());
  if (!node.IsMap()) return false;
  return std::any_of(node.begin(), node.end(),
                     [](const auto& pair) { return pair.second.IsScalar() && IsModemLine(pair.second.Scalar()); });
}

constexpr const char* kModemRefusal =
    "RTS and DTR cannot be used: opening the port toggles them, which on CLR would zero the machine and on CLK "
    "would "
    "ask for frames; wire it to a GPIO line: {chip: /dev/gpiochip0, line: 5}";

std::optional<Line> ParseLine(ConfigMap& lines, const BusConfig& bus, std::string_view name, std::int64_t usual_us,
                              SaaBus& into) {
  if (!lines.Has(name)) return std::nullopt;
  const YAML::Node node = lines.node()[std::string(name)];
  if (NamesModemLine(node)) {
    lines.Error(name, kModemRefusal);
    return std::nullopt;
  }
  ConfigMap map = lines.Map(name);
  PulseLineConfig config;
  config.name = name;
  config.chip = map.String("chip", "");
  config.offset = static_cast<int>(map.Integer("line", 0, 0, 1'023, "(offset on its chip)"));
  Line line;
  line.index = static_cast<std::uint8_t>(into.lines.size());
  line.low =
      map.Integer("low_us", usual_us, kMinLowUs, kMaxLowUs, "us (SAA manual 5.1.3: T2 >= 10 us)") * kMicrosecond;
  if (!bus.simulate && (!map.Has("chip") || !map.Has("line"))) {
    map.Error("chip", "and line are needed, e.g. {chip: /dev/gpiochip0, line: 5}; gpioinfo lists them");
  } else if (!config.chip.empty() && !config.chip.starts_with("/dev/gpiochip")) {
    map.Error("chip", "'" + config.chip + "' is no GPIO chip, e.g. /dev/gpiochip0; gpiodetect lists them");
  }
  map.Done();
  into.lines.push_back(std::move(config));
  return line;
}

// Reads the bus's key `lines`: {clk: {chip, line, low_us}, clr: {chip, line, low_us}}, as its mode needs them. Refuses
// modem-control lines.
void ParseLines(ConfigMap& map, const BusConfig& bus, SaaBus& into) {
  ConfigMap lines = map.Map("lines");
  if (into.mode == Mode::kHandshake) {
    into.clk = ParseLine(lines, bus, "clk", kClkLowUs, into);
    if (!lines.Has("clk")) {
      lines.Error("clk",
                  "is missing: in mode handshake each falling edge on CLK asks for a frame: "
                  "{chip: /dev/gpiochip0, line: 5}");
    }
  } else if (lines.Has("clk")) {
    lines.Error("clk", "only mode handshake has a CLK line: leave it out");
  }
  if (into.mode != Mode::kBus) {
    into.clr = ParseLine(lines, bus, "clr", kClrLowUs, into);
  } else if (lines.Has("clr")) {
    lines.Error("clr", NamesModemLine(lines.node()["clr"])
                           ? kModemRefusal
                           : "mode bus clears to zero by command, not by CLR: set zero_clearing: true instead");
  }
  const bool both = into.lines.size() == 2 && !bus.simulate;
  if (both && into.lines[0].chip == into.lines[1].chip && into.lines[0].offset == into.lines[1].offset) {
    lines.Error("clr", "is the same line as clk: each reading would zero the encoder");
  }
  lines.Done();
}

}  // namespace

std::shared_ptr<const FamilyBus> ParseBus(ConfigMap& map, const BusConfig& bus) {
  auto own = std::make_shared<SaaBus>();
  map.Require("mode", "timing, handshake or bus, as the encoder was ordered");
  own->mode = static_cast<Mode>(map.Choice("mode", {"timing", "handshake", "bus"}, 2));
  if (bus.link.line.baud == 0) {
    map.Error("link", "needs baud: the maker sets it to order, there is no usual one");
  }
  ParseLines(map, bus, *own);
  ParseTiming(map, bus, *own);
  own->zero_clearing = own->clr.has_value();
  if (own->mode == Mode::kBus) {
    own->zero_clearing = map.Bool("zero_clearing", false);
  } else if (map.Has("zero_clearing")) {
    map.Error("zero_clearing",
              "is of mode bus only: here the encoder clears to zero by its CLR line, lines: {clr: …}");
  }
  return own;
}

std::unique_ptr<DeviceSettings> ParseDevice(ConfigMap& device, const BusConfig& bus) {
  const SaaBus& own = OwnBus(bus);
  auto settings = std::make_unique<SaaSettings>();
  settings->model = saa::kModels.at(device.Choice("model", {saa::kModels.begin(), saa::kModels.end()}, 0));
  device.Require("bits", "the resolution, 10 to 26, as on the encoder's label");
  settings->format.bits = static_cast<int>(device.Integer("bits", 14, kMinBits, kMaxBits, "bits"));
  ParseAddress(device, own, *settings);
  ParseTimes(device, own, *settings);
  settings->counts_per_turn = std::int64_t{1} << settings->format.bits;
  settings->max_speed_rpm = saa::kMaxSpeedRpm;
  settings->noise_counts = saa::NoiseCounts(settings->format.bits);
  const std::size_t characters = ReplySize(settings->format.bits) + (own.mode == Mode::kBus ? kRequestSize : 0);
  const MonoNs on_wire = bus.link.line.WireTime(characters);
  settings->wire_time = std::max(on_wire, own.refresh);
  // The request, or the edge on CLK, triggers it. T3, in which it acquires and processes, has no figure in the manual.
  settings->latch_after = bus.link.line.WireTime(own.mode == Mode::kBus ? kRequestSize : 0);
  if (own.mode == Mode::kTiming && on_wire > own.refresh) {
    device.Error("bits", "frames of " + std::to_string(characters) + " characters take " +
                             std::to_string(on_wire / kMicrosecond) +
                             " us, longer than the period of refresh_hz: check baud and refresh_hz");
  }
  return settings;
}

void CheckBus(ConfigMap& map, const BusConfig& bus) {
  if (OwnBus(bus).mode == Mode::kBus) return CheckCommands(map, bus);
  if (bus.devices.size() > 1) {
    map.Error("devices", "modes timing and handshake have no addresses: one encoder per bus; give '" +
                             bus.devices[1].name + "' a bus of its own, or order mode bus");
  }
}

const SaaBus& OwnBus(const BusConfig& bus) { return static_cast<const SaaBus&>(*bus.family_bus); }
const SaaSettings& Own(const DeviceConfig& device) { return static_cast<const SaaSettings&>(*device.settings); }

std::int64_t ZeroToleranceCounts(int bits) {
  const double counts = kZeroToleranceDeg / 360 * static_cast<double>(std::int64_t{1} << bits);
  return std::max<std::int64_t>(2, std::llround(counts));
}

}  // namespace axlecast::saa_serial
