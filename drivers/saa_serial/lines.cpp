#include "drivers/saa_serial/lines.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <string>

#include "core/config/config_map.h"

namespace axlecast::saa_serial {
namespace {

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

}  // namespace

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

}  // namespace axlecast::saa_serial
