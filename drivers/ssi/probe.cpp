#include "drivers/ssi/family.h"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/device/operation.h"
#include "drivers/kit/asking_probe.h"
#include "drivers/kit/clocked_line.h"
#include "drivers/ssi/codec.h"

namespace axlecast::ssi {
namespace {

constexpr int kTransfers = 32;
constexpr std::size_t kTransferBytes = 8;  // the idle level, and 63 clocks: every word of 26 bits twice
constexpr std::size_t kBits = 8 * kTransferBytes - 1;
constexpr int kMinWord = 10;
constexpr int kMaxWord = 26;  // SAA manual 4.1; TWK's tree has 25
constexpr int kTreeWord = 25;
constexpr std::size_t kVaried =
    3;  // words that prove a turning shaft: otherwise a short pattern may look like a repeated word
constexpr MonoNs kTransferTimeout = 100 * kMillisecond;
constexpr MonoNs kRest = kMillisecond;      // longer than the pause of either maker (SAA 5.5: 500 us)
constexpr std::int64_t kClockHz = 125'000;  // within 100 to 250 kHz (SAA 5.5), and within TWK's limits
constexpr int kMode = 2;                    // as the driver's: the clock idles high, sampled on falling edges

// Bit `index` behind the idle level.
bool BitOf(Bytes bytes, std::size_t index) { return BitAt(bytes, index + 1); }

bool Repeats(Bytes bytes, std::size_t period) {
  for (std::size_t i = 0; i + period < kBits; ++i) {
    if (BitOf(bytes, i) != BitOf(bytes, i + period)) return false;
  }
  return true;
}

// Clocks words out of whatever is there, far more clocks than a word has, and looks whether the word comes again. A word of
// SSI has neither check bits nor an end: little can be known. Nothing but the clock goes out.
class SsiProbe final : public AskingProbe {
 public:
  SsiProbe() : transfer_(ClockedExchange(kTransferBytes, kTransferTimeout)) {
    for (int bits = kMinWord; bits <= kMaxWord; ++bits) lengths_.push_back({.bits = bits});
  }

  [[nodiscard]] std::vector<ProbeHit> Findings() const override {
    if (answered_ < kTransfers / 2) return {};
    for (const Length& length : lengths_) {
      if (length.repeats) return {FindingOf(length.bits, AfterWord::kWord)};
      if (length.zero_repeats) return {FindingOf(length.bits, AfterWord::kZeroThenWord)};
    }
    if (last_one_ > kMaxWord) return {};  // bits without an order: noise, or a clock that is wrong for it
    return {FindingOf(last_one_, AfterWord::kZeros)};
  }
  [[nodiscard]] double Progress() const override { return static_cast<double>(asked_) / kTransfers; }

 protected:
  [[nodiscard]] std::optional<Question> Ask() const override {
    if (asked_ >= kTransfers) return std::nullopt;
    return Question{.exchange = transfer_, .quiet = kRest};
  }
  void Evaluate(const Event& event) override {
    ++asked_;
    const Bytes bytes = event.bytes;
    if (bytes.size() != kTransferBytes || (bytes[0] & 0x80U) == 0) return;  // not high at rest: no SSI
    int ones = 0;
    int last = 0;
    std::uint64_t word = 0;
    for (std::size_t i = 0; i < kBits; ++i) {
      const bool bit = BitOf(bytes, i);
      word = word << 1U | (bit ? 1U : 0U);
      if (bit) last = static_cast<int>(i) + 1;
      ones += bit ? 1 : 0;
    }
    if (ones == 0 || ones == static_cast<int>(kBits)) return;  // a cut wire, or nobody
    ++answered_;
    words_.insert(word);
    last_one_ = std::max(last_one_, last);
    for (Length& length : lengths_) {
      const auto bits = static_cast<std::size_t>(length.bits);
      length.repeats = length.repeats && Repeats(bytes, bits);
      length.zero_repeats = length.zero_repeats && !BitOf(bytes, bits) && Repeats(bytes, bits + 1);
    }
  }

 private:
  // How the line behaves behind a word of so many bits, in every transfer so far.
  struct Length {
    int bits = 0;
    bool repeats = true;       // the word comes again at once
    bool zero_repeats = true;  // after one zero
  };

  [[nodiscard]] ProbeHit FindingOf(int bits, AfterWord after) const {
    const bool tree = bits == kTreeWord && after != AfterWord::kWord;
    const bool turned = words_.size() >= kVaried;
    ProbeHit finding;
    finding.confidence = after != AfterWord::kZeros && turned ? Confidence::kLikely : Confidence::kPossible;
    finding.device =
        Text("encoder on SSI, a word of %d bits%s", bits, after == AfterWord::kZeros ? " or more" : "");
    const char* behind = after == AfterWord::kWord           ? "the word came again at once"
                         : after == AfterWord::kZeroThenWord ? "the word came again after a zero"
                                                             : "zeros followed the word";
    finding.reason = Text("%d of %d transfers began high and held a word; %s%s", answered_, asked_, behind,
                          turned ? "" : "; the shaft stood still");
    if (tree) {
      finding.keys = {{"model", "twk"}, {"bits", "13"}, {"turn_bits", "12"}};
    } else {
      finding.keys = {{"model", "saa"}, {"bits", std::to_string(std::max(bits, kMinWord))}};
    }
    finding.check =
        "model, bits, turn_bits and code (binary or gray): a word of SSI does not contain them; see the label";
    return finding;
  }

  Exchange transfer_;
  int asked_ = 0;
  int answered_ = 0;  // high before the clock, and neither only ones nor only zeros after
  std::vector<Length> lengths_;
  int last_one_ = 0;  // bits up to the last 1 that was ever seen
  std::set<std::uint64_t> words_;
};

}  // namespace
}  // namespace axlecast::ssi

namespace axlecast {

std::vector<ProbeTrial> ssi_probe(const ProbeScope& scope) {
  std::vector<ProbeTrial> trials;
  for (const std::int64_t clock : scope.rates.empty() ? std::vector{ssi::kClockHz} : scope.rates) {
    ProbeTrial trial;
    trial.what = "SSI words";
    trial.asks = true;
    trial.spi = {.mode = ssi::kMode, .clock_hz = clock};
    trial.longest = ssi::kTransfers * 3 * ssi::kRest;
    trial.make = [](MonoNs) { return std::make_unique<ssi::SsiProbe>(); };
    trials.push_back(std::move(trial));
  }
  return trials;
}

}  // namespace axlecast
