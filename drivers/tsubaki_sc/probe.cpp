#include <algorithm>
#include <array>
#include <memory>
#include <string>

#include "core/device/operation.h"
#include "drivers/kit/asking_probe.h"
#include "drivers/tsubaki_sc/family.h"
#include "drivers/tsubaki_sc/requests.h"
#include "drivers/tsubaki_sc/settings.h"

namespace axlecast::tsubaki_sc {
namespace {

constexpr std::array<Block, 4> kBlocks = {kStatus, kProductCode, kMfgNumber, kVersion};
constexpr MonoNs kPatience = 90 * kMillisecond;              // as in the driver, in addition to request and reply
constexpr MonoNs kQuiet = kCommandPause + 5 * kMillisecond;  // guideline 3, in every reading
constexpr int kAttempts = 2;                                 // of a request whose reply is damaged
constexpr std::size_t kLongest = 8 + 15;                     // characters of the longest request and reply

MonoNs Timeout() { return kUnitLine.WireTime(kLongest) + kPatience; }

std::string NameOf(const Answer& answer) {
  if (answer.block == kVersion) return ", " + VersionText(answer.reply.data);
  const std::string text = RegisterText(answer.reply.data, CharacterOrder::kHighFirst);
  if (answer.block == kProductCode) return ", product code " + text;
  return answer.block == kMfgNumber ? ", manufacturing number " + text : "";
}

// Reads the status (AI 200 to 204) at one address after the other. If a unit answers, its product code, manufacturing
// number and version are read. Reads need no login, and nothing is ever written.
class ScProbe final : public AskingProbe {
 public:
  ScProbe(int first, int last) : first_(first), last_(last), address_(first) {}

  [[nodiscard]] std::vector<ProbeHit> Findings() const override { return findings_; }
  [[nodiscard]] double Progress() const override {
    return static_cast<double>(address_ - first_) / static_cast<double>(last_ - first_ + 1);
  }

 protected:
  [[nodiscard]] std::optional<Question> Ask() const override {
    if (address_ > last_) return std::nullopt;
    const Requests requests(static_cast<std::uint8_t>(address_), Timeout());
    return Question{.exchange = requests.Read(kBlocks.at(block_)), .quiet = kQuiet};
  }

  void Evaluate(const Event& event) override {
    const Answer answer = Interpret(event, 0);
    ++tries_;
    if (!answer.ok() && !event.bytes.empty() && tries_ < kAttempts) return;
    tries_ = 0;
    if (answer.ok()) {
      ++answered_;
      named_ += NameOf(answer);
    }
    if (++block_ < kBlocks.size() && answered_ > 0) return;
    if (answered_ > 0) AddHit();
    ++address_;
    block_ = 0;
    answered_ = 0;
    named_.clear();
  }

 private:
  void AddHit() {
    constexpr int kAll = static_cast<int>(kBlocks.size());
    ProbeHit hit;
    hit.confidence = answered_ == kAll ? Confidence::kSure
                     : answered_ > 1   ? Confidence::kLikely
                                       : Confidence::kPossible;
    hit.device = Text("Tsubaki SC unit, address %d", address_) + named_;
    hit.reason = Text("answered %d of %d blocks that only this unit has in these places, with the right CRC",
                      answered_, kAll);
    hit.keys = {{"address", std::to_string(address_)}};
    findings_.push_back(std::move(hit));
  }

  int first_;
  int last_;
  int address_;
  std::size_t block_ = 0;  // that is read next
  int tries_ = 0;
  int answered_ = 0;   // blocks
  std::string named_;  // product code, number and version of the unit
  std::vector<ProbeHit> findings_;
};

}  // namespace
}  // namespace axlecast::tsubaki_sc

namespace axlecast {

std::vector<ProbeTrial> tsubaki_sc_probe(const ProbeScope& scope) {
  using namespace tsubaki_sc;
  const int first = std::max(1, scope.first_address);
  const int last = std::min(kLastAddress, scope.last_address);
  if (first > last || scope.RatesOf({kUnitLine.baud}).empty()) return {};
  ProbeTrial trial;
  trial.what = Text("SC units, addresses %d to %d", first, last);
  trial.asks = true;
  trial.line = kUnitLine;
  trial.longest = (last - first + 1) * (kUnitLine.WireTime(8) + Timeout() + kQuiet);
  trial.make = [first, last](MonoNs) { return std::make_unique<ScProbe>(first, last); };
  return {trial};
}

}  // namespace axlecast
