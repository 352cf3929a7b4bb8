#pragma once

// What the fuzzers of the families' probes share: whatever comes, a probe comes to an end, asks nothing but reads, and what
// it reports as found can be printed.

#include <fuzzer/FuzzedDataProvider.h>

#include <cstdlib>
#include <variant>
#include <vector>

#include "core/device/probe.h"

namespace axlecast {

// One probe's life: every step of it ends as the input specifies; without more input nothing comes.
class ProbeFuzz {
 public:
  ProbeFuzz(const std::vector<ProbeTrial>& trials, FuzzedDataProvider& input) : input_(input) {
    const ProbeTrial& trial = trials.at(input.ConsumeIntegralInRange<std::size_t>(0, trials.size() - 1));
    probe_ = trial.make(now_);
  }

  // `reads(request)`: whether the request changes nothing in any device.
  template <typename Reads>
  void Run(Reads reads) {
    for (int steps = 0;; ++steps) {
      const std::optional<Step> step = probe_->Next(now_);
      if (!step) break;
      Check(steps < kMaxSteps);
      if (const auto* exchange = std::get_if<Exchange>(&step->action)) Check(reads(exchange->request));
      Check(!std::holds_alternative<Send>(step->action));
      End(*step);
    }
    for (const ProbeHit& finding : probe_->Findings()) Check(!finding.device.empty() && !finding.reason.empty());
    Check(probe_->Progress() >= 0);
  }

 private:
  static constexpr int kMaxSteps = 200'000;

  static void Check(bool holds) {
    if (!holds) std::abort();
  }

  void End(const Step& step) {
    now_ += kMillisecond;
    Event event;
    const bool some = input_.remaining_bytes() > 0;
    bytes_ = some ? input_.ConsumeBytes<std::uint8_t>(input_.ConsumeIntegralInRange<std::size_t>(0, 24))
                  : std::vector<std::uint8_t>();
    event.bytes = bytes_;
    event.sent = {now_ - kMillisecond, now_ - kMillisecond};
    event.received = {now_, now_};
    if (const auto* exchange = std::get_if<Exchange>(&step.action)) {
      event.request = exchange->request;
      event.kind = some && input_.ConsumeBool() ? Event::Kind::kReply : Event::Kind::kTimeout;
    } else if (some) {
      event.id = input_.ConsumeIntegral<std::uint32_t>();
      event.kind = input_.PickValueInArray({Event::Kind::kUnexpectedBytes, Event::Kind::kUnsolicited,
                                            Event::Kind::kFrame, Event::Kind::kSilent, Event::Kind::kLinkDown});
    } else if (const auto* listen = std::get_if<Listen>(&step.action)) {
      now_ = listen->until;
      event.received = {now_, now_};
    }
    probe_->On(event);
  }

  FuzzedDataProvider& input_;
  std::unique_ptr<Probe> probe_;
  MonoNs now_ = 1'000 * kSecond;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace axlecast
