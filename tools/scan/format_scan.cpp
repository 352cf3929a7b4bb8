#include "tools/scan/format_scan.h"

#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "core/config/load.h"
#include "drivers/hal/line_guard.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::array<const char*, 3> kConfidences = {"possible", "likely", "sure"};
constexpr std::array<const char*, 3> kParities = {"none", "even", "odd"};
constexpr std::array<char, 3> kParityLetters = {'N', 'E', 'O'};

template <typename Value>
constexpr auto Of(const Value& table, auto index) {
  return table.at(static_cast<std::size_t>(index));
}

const char* ConfidenceOf(const FoundDevice& device) { return Of(kConfidences, device.finding.confidence); }

// Returns the hit of the highest confidence that can be configured, or null.
const FoundDevice* Surest(const ScanReport& report) {
  const FoundDevice* best = nullptr;
  for (const FoundDevice& device : report.found) {
    if (device.finding.keys.empty()) continue;
    if (best == nullptr || device.finding.confidence > best->finding.confidence) best = &device;
  }
  return best;
}

bool SameBus(const FoundDevice& a, const FoundDevice& b) {
  return a.family == b.family && a.finding.bus == b.finding.bus && a.trial.line.baud == b.trial.line.baud &&
         a.trial.line.parity == b.trial.line.parity && a.trial.bitrate == b.trial.bitrate;
}

// Formats any text as a double-quoted YAML scalar.
std::string QuotedYaml(const std::string& text) {
  return Json(text).dump(-1, ' ', false, Json::error_handler_t::replace);
}

// Parses a YAML scalar of a probe: numbers and quoted texts are the same in JSON.
Json JsonOf(const std::string& scalar) {
  Json json = Json::parse(scalar, nullptr, false);
  return json.is_discarded() ? Json(scalar) : json;
}

std::string Flow(const ProbeHit::Keys& keys) {
  std::string text;
  for (const auto& [key, value] : keys) text += (text.empty() ? "" : ", ") + key + ": " + value;
  return '{' + text + '}';
}

ProbeHit::Keys LinkOf(const ScanPlace& place, const FoundDevice& device) {
  ProbeHit::Keys keys = {{LinkKey(device.family->link), QuotedYaml(place.port)}};
  const ProbeTrial& trial = device.trial;
  switch (place.kind) {
    case ScanLineKind::kSerial:
      keys.emplace_back("baud", std::to_string(trial.line.baud));
      if (trial.line.parity != device.family->default_line.parity) {
        keys.emplace_back("parity", Of(kParities, trial.line.parity));
      }
      if (place.echo) keys.emplace_back("echo", "true");
      if (IsPtyByNumber(place.port)) keys.emplace_back("pty", "true");
      break;
    case ScanLineKind::kCan:
      if (trial.bitrate > 0) keys.emplace_back("bitrate", std::to_string(trial.bitrate));
      break;
    case ScanLineKind::kSpi:
      keys.emplace_back("clock_hz", std::to_string(trial.spi.clock_hz));
      break;
  }
  return keys;
}

std::string Comment(const std::string& indent, const std::string& text) {
  return text.empty() ? "" : indent + "# " + text + '\n';
}

std::string SinceText(double seconds) {
  std::array<char, 32> text{};
  static_cast<void>(std::snprintf(text.data(), text.size(), "%.4g", seconds));
  return text.data();
}

}  // namespace

std::string LineText(const ProbeTrial& trial, ScanLineKind kind) {
  switch (kind) {
    case ScanLineKind::kSerial:
      return std::to_string(trial.line.baud) + " baud 8" + Of(kParityLetters, trial.line.parity) +
             std::to_string(trial.line.stop_bits);
    case ScanLineKind::kCan:
      return trial.bitrate == 0 ? "" : SinceText(static_cast<double>(trial.bitrate) / 1e3) + " kbit/s";
    case ScanLineKind::kSpi:
      break;
  }
  return SinceText(static_cast<double>(trial.spi.clock_hz) / 1e3) + " kHz";
}

std::string ScanYaml(const ScanPlace& place, const ScanReport& report) {
  const FoundDevice* first = Surest(report);
  if (first == nullptr) return "";
  std::string text = "# Found by `axlecast scan` on " + place.port + ".\n";
  text += "machine: " + place.machine + "\nbuses:\n  " + place.bus +
          ":\n    family: " + std::string(first->family->name);
  text += "\n    link: " + Flow(LinkOf(place, *first)) + '\n';
  for (const auto& [key, value] : first->finding.bus) text += "    " + key + ": " + value + '\n';
  text += "    devices:\n";
  const char* name = first->family->has_position ? "axis" : "motor";
  int number = 0;
  for (const FoundDevice& device : report.found) {
    if (device.finding.keys.empty() || !SameBus(device, *first)) continue;
    text += Comment("      ", std::string(ConfidenceOf(device)) + ": " + device.finding.reason);
    text += Comment("      ", device.finding.check.empty() ? "" : "LOOK UP " + device.finding.check);
    text += "      " + std::string(name) + std::to_string(++number) + ": " + Flow(device.finding.keys) + '\n';
  }
  return text;
}

std::string ScanText(const ScanPlace& place, const ScanReport& report) {
  std::string text;
  for (const FoundDevice& device : report.found) {
    const std::string line = LineText(device.trial, place.kind);
    text +=
        std::string(ConfidenceOf(device)) + ": " + device.finding.device + (line.empty() ? "" : ", " + line) + '\n';
    text += "    " + device.finding.reason + '\n';
    if (!device.finding.check.empty()) text += "    look up " + device.finding.check + '\n';
  }
  if (report.found.empty()) text += "nothing was found on " + place.port + '\n';
  if (!report.complete) text += "the scan was stopped before its end; found until then:\n";
  for (const std::string& note : report.notes) text += "note: " + note + '\n';
  return text;
}

Json ScanJson(const ScanPlace& place, const ScanReport& report) {
  Json found = Json::array();
  for (const FoundDevice& device : report.found) {
    const auto object = [](const ProbeHit::Keys& keys) {
      Json json = Json::object();
      for (const auto& [key, value] : keys) json[key] = JsonOf(value);
      return json;
    };
    found.push_back({{"family", device.family->name},
                     {"confidence", ConfidenceOf(device)},
                     {"device", device.finding.device},
                     {"reason", device.finding.reason},
                     {"check", device.finding.check},
                     {"line", LineText(device.trial, place.kind)},
                     {"link", object(LinkOf(place, device))},
                     {"bus", object(device.finding.bus)},
                     {"keys", object(device.finding.keys)}});
  }
  return {{"port", place.port}, {"complete", report.complete}, {"asked", report.asked},
          {"found", found},     {"notes", report.notes},       {"yaml", ScanYaml(place, report)}};
}

}  // namespace axlecast
