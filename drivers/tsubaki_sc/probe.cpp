#include "drivers/tsubaki_sc/probe.h"

#include <algorithm>
#include <array>
#include <memory>

#include "core/device/operation.h"
#include "drivers/tsubaki_sc/requests.h"
#include "drivers/tsubaki_sc/settings.h"

namespace axlecast::tsubaki_sc {
namespace {

constexpr std::array<Block, 4> kBlocks = {kStatus, kProductCode, kMfgNumber, kVersion};
constexpr MonoNs kPatience = 90 * kMillisecond;              // as the driver's own, beyond request and reply
constexpr MonoNs kQuiet = kCommandPause + 5 * kMillisecond;  // guideline 3, however it is meant
constexpr int kAttempts = 2;                                 // of a question whose answer came damaged
constexpr std::size_t kLongest = 8 + 15;                     // characters of the longest request and reply

MonoNs TimeoutOf() { return kUnitLine.WireTime(kLongest) + kPatience; }

std::string NameOf(const Answer& answer) {
  if (answer.block == kVersion) return ", " + VersionText(answer.reply.data);
  const std::string text = RegisterText(answer.reply.data, CharacterOrder::kHighFirst);
  if (answer.block == kProductCode) return ", product code " + text;
  return answer.block == kMfgNumber ? ", manufacturing number " + text : "";
}

}  // namespace

std::optional<AskingProbe::Question> ScProbe::Ask() const {
  if (address_ > last_) return std::nullopt;
  const Requests requests(static_cast<std::uint8_t>(address_), TimeoutOf());
  return Question{.exchange = requests.Read(kBlocks.at(block_)), .quiet = kQuiet};
}

void ScProbe::Judge(const Event& event) {
  const Answer answer = Interpret(event, 0);
  ++tries_;
  if (!answer.ok() && !event.bytes.empty() && tries_ < kAttempts) return;
  tries_ = 0;
  if (answer.ok()) {
    ++answered_;
    named_ += NameOf(answer);
  }
  if (++block_ < kBlocks.size() && answered_ > 0) return;
  if (answered_ > 0) Add();
  NextAddress();
}

void ScProbe::Add() {
  constexpr int kAll = static_cast<int>(kBlocks.size());
  ProbeHit finding;
  finding.confidence = answered_ == kAll ? Confidence::kSure
                       : answered_ > 1   ? Confidence::kLikely
                                         : Confidence::kPossible;
  finding.device = Text("Tsubaki SC unit, address %d", address_) + named_;
  finding.reason =
      Text("answered %d of %d blocks that only this unit has in these places, with the right CRC", answered_, kAll);
  finding.keys = {{"address", std::to_string(address_)}};
  findings_.push_back(std::move(finding));
}

void ScProbe::NextAddress() {
  ++address_;
  block_ = 0;
  answered_ = 0;
  named_.clear();
}

double ScProbe::Progress() const {
  return static_cast<double>(address_ - first_) / static_cast<double>(last_ - first_ + 1);
}

// ---- what is tried ----

namespace {

std::vector<ProbeTrial> ProbeTrials(const ProbeScope& scope) {
  const int first = std::max(1, scope.first_address);
  const int last = std::min(kLastAddress, scope.last_address);
  if (first > last || scope.RatesOf({kUnitLine.baud}).empty()) return {};
  ProbeTrial trial;
  trial.what = Text("SC units, addresses %d to %d", first, last);
  trial.asks = true;
  trial.line = kUnitLine;
  trial.longest = (last - first + 1) * (kUnitLine.WireTime(8) + TimeoutOf() + kQuiet);
  trial.make = [first, last](MonoNs) { return std::make_unique<ScProbe>(first, last); };
  return {trial};
}

}  // namespace

}  // namespace axlecast::tsubaki_sc

namespace axlecast {

std::vector<ProbeTrial> tsubaki_sc_probe(const ProbeScope& scope) { return tsubaki_sc::ProbeTrials(scope); }

}  // namespace axlecast
