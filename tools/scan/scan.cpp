#include "tools/scan/scan.h"

#include <algorithm>
#include <memory>
#include <utility>

namespace axlecast {
namespace {

ScanLineKind KindOf(LinkKind link) {
  switch (link) {
    case LinkKind::kCan:
      return ScanLineKind::kCan;
    case LinkKind::kSpi:
      return ScanLineKind::kSpi;
    case LinkKind::kSerial:
    case LinkKind::kModbus:
      break;
  }
  return ScanLineKind::kSerial;
}

constexpr MonoNs kListen = 1'500 * kMillisecond;  // longer than the pauses of devices that transmit unasked
constexpr MonoNs kStepTimeout = 50 * kMillisecond;

bool SameLine(const ProbeTrial& a, const ProbeTrial& b) {
  return a.line.baud == b.line.baud && a.line.parity == b.line.parity && a.line.stop_bits == b.line.stop_bits &&
         a.bitrate == b.bitrate && a.spi == b.spi;
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

MonoNs LongestOf(std::span<const PlannedTrial> trials) {
  MonoNs longest = 0;
  for (const PlannedTrial& planned : trials) longest += planned.trial.longest;
  return longest;
}

ScanReport RunScan(ScanLine& line, const Clock& clock, std::vector<PlannedTrial> plan, const ScanHooks& hooks) {
  return ScanRun(line, clock, std::move(plan), hooks).Run();
}

}  // namespace axlecast
