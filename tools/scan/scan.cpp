#include "tools/scan/scan.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/config/load.h"
#include "drivers/hal/line_guard.h"

namespace axlecast {
namespace {

ScanLineKind KindOf(LinkKind link) {
  if (link == LinkKind::kCan) return ScanLineKind::kCan;
  return link == LinkKind::kSpi ? ScanLineKind::kSpi : ScanLineKind::kSerial;
}

constexpr MonoNs kListen = 1'500 * kMillisecond;  // longer than the pauses of devices that transmit unasked
constexpr MonoNs kStepTimeout = 50 * kMillisecond;

bool SameLine(const ProbeTrial& a, const ProbeTrial& b) {
  return a.line.baud == b.line.baud && a.line.parity == b.line.parity && a.line.stop_bits == b.line.stop_bits &&
         a.bitrate == b.bitrate && a.spi == b.spi;
}

// Returns the duration of the trials if nothing answers.
MonoNs LongestOf(std::span<const PlannedTrial> trials) {
  MonoNs longest = 0;
  for (const PlannedTrial& planned : trials) longest += planned.trial.longest;
  return longest;
}

class ScanRun {
 public:
  ScanRun(ScanLine& line, const Clock& clock, std::vector<PlannedTrial> plan, const ScanHooks& hooks)
      : line_(line), clock_(clock), hooks_(hooks) {
    guard_.AddDevice();
    const auto asking = std::ranges::find_if(plan, [](const auto& p) { return p.trial.asks; });
    listening_.assign(std::make_move_iterator(plan.begin()), std::make_move_iterator(asking));
    asking_.assign(std::make_move_iterator(asking), std::make_move_iterator(plan.end()));
  }

  ScanReport Run() {
    if (asking_.empty()) {
      Try(listening_);
      return std::move(report_);
    }
    if (!listening_.empty() && ReceivesUnasked()) {
      Try(listening_);
      if (report_.complete && report_.found.empty()) {
        Note(
            "unknown bytes are received: from another master, or from a device at a rate that was not tried. So "
            "nothing was sent. Give the rate with --baud, or disconnect the sender");
      }
      return std::move(report_);
    }
    if (report_.complete) Ask();
    return std::move(report_);
  }

 private:
  bool ReceivesUnasked() {
    if (!line_.Set(listening_.front().trial)) return true;  // each trial reports that it cannot be made
    const MonoNs until = clock_.Now() + kListen;
    while (clock_.Now() < until && !Stopped()) {
      hooks_.progress(listening_.front(), 0, until - clock_.Now());
      const Event* event = line_.transactor().Run(Step{.action = Listen{until}}, clock_.Now() + kStepTimeout);
      if (event == nullptr) continue;
      if (event->kind == Event::Kind::kLinkDown) return Lost();
      if (!event->bytes.empty()) return true;
    }
    return false;
  }

  void Ask() {
    if (!hooks_.may_ask()) {
      return Note(
          "the line is quiet, and nothing was sent on it: only devices that transmit unasked could be found");
    }
    report_.asked = true;
    Try(asking_);
  }

  void Try(std::span<PlannedTrial> trials) {
    for (std::size_t i = 0; i < trials.size() && report_.complete && !disturbed_; ++i) {
      if (Worthwhile(trials[i])) TryOne(trials[i], LongestOf(trials.subspan(i + 1)));
    }
  }

  // After a likely hit, only the same family at the same rate can find more.
  [[nodiscard]] bool Worthwhile(const PlannedTrial& planned) const {
    const auto settles = [](const FoundDevice& device) {
      return device.finding.confidence != Confidence::kPossible && !device.finding.keys.empty();
    };
    const auto first = std::ranges::find_if(report_.found, settles);
    return first == report_.found.end() ||
           (first->family == planned.family && SameLine(first->trial, planned.trial));
  }

  void TryOne(const PlannedTrial& planned, MonoNs after) {
    if (!line_.Set(planned.trial)) return CannotMake(planned.trial);
    const std::unique_ptr<Probe> probe = planned.trial.make(clock_.Now());
    const bool kept = RunProbe(*probe, line_.transactor(), clock_, guard_, [&] {
      const double done = std::clamp(probe->Progress(), 0.0, 1.0);
      const auto left = static_cast<MonoNs>((1 - done) * static_cast<double>(planned.trial.longest));
      hooks_.progress(planned, done, left + after);
      return Stopped();
    });
    if (!kept) static_cast<void>(Lost());
    for (ProbeHit& finding : probe->Findings()) {
      report_.found.push_back({planned.family, planned.trial, std::move(finding)});
    }
    if (!probe->Disturbed()) return;
    disturbed_ = true;
    Note("another master transmits on the line: nothing more was sent");
  }

  void CannotMake(const ProbeTrial& trial) {
    Note("the port does not support this trial, so it was not tried: " + trial.what);
  }

  bool Stopped() {
    if (hooks_.stop()) report_.complete = false;
    return !report_.complete;
  }
  bool Lost() {
    report_.complete = false;
    Note("the line was lost: unplugged?");
    return false;
  }
  void Note(std::string text) {
    if (std::ranges::find(report_.notes, text) == report_.notes.end()) {
      report_.notes.push_back(std::move(text));
    }
  }

  ScanLine& line_;
  const Clock& clock_;
  const ScanHooks& hooks_;
  std::vector<PlannedTrial> listening_;
  std::vector<PlannedTrial> asking_;
  ScanReport report_;
  // For all trials: a late reply can arrive during a trial at another rate.
  StaleReplyGuard guard_{kLatestProbeReply};
  bool disturbed_ = false;
};

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

std::vector<PlannedTrial> PlanScan(std::span<const FamilyProbe> probes, ScanLineKind kind,
                                   const ProbeScope& scope) {
  std::vector<PlannedTrial> plan;
  for (const FamilyProbe& probe : probes) {
    if (KindOf(probe.family->link) != kind) continue;
    for (ProbeTrial& trial : probe.trials(scope)) plan.push_back({probe.family, std::move(trial)});
  }
  std::ranges::stable_sort(plan, [](const PlannedTrial& a, const PlannedTrial& b) {
    if (a.trial.asks != b.trial.asks) return b.trial.asks;
    return a.trial.asks && a.trial.longest < b.trial.longest;
  });
  return plan;
}

ScanReport RunScan(ScanLine& line, const Clock& clock, std::vector<PlannedTrial> plan, const ScanHooks& hooks) {
  return ScanRun(line, clock, std::move(plan), hooks).Run();
}

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
