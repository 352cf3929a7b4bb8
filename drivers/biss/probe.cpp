#include "drivers/biss/family.h"

#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "core/device/operation.h"
#include "drivers/biss/codec.h"
#include "drivers/biss/settings.h"
#include "drivers/kit/asking_probe.h"
#include "drivers/kit/clocked_line.h"

namespace axlecast::biss {
namespace {

constexpr int kTransfers = 32;
constexpr int kEnough = 28;                // of them must fit: a bad cable spoils a few
constexpr int kSaaBits = 26;               // SAA manual 4.1, the most
constexpr std::size_t kTransferBytes = 9;  // acknowledgement, start and the longest frame, and something behind it
constexpr MonoNs kTransferTimeout = 100 * kMillisecond;
constexpr MonoNs kRest = kMillisecond;  // far longer than the encoder's timeout (5.6)
constexpr std::size_t kVaried = 3;      // positions that prove a turning shaft
constexpr int kFallingMode = 2;         // as in settings.cpp
constexpr int kRisingMode = 3;

// What comes behind a frame, until the encoder's timeout, is low.
bool IsLowFrom(Bytes samples, std::size_t first) {
  for (std::size_t at = first; at < 8 * samples.size(); ++at) {
    if ((samples[at / 8] >> (7 - at % 8) & 1U) != 0) return false;
  }
  return true;
}

// Clocks frames out of whatever is there, and looks at which resolution their check bits fit: x^6 + x + 1, single-turn, as
// the SAA encoders have it. Nothing but the clock goes out.
class BissProbe final : public AskingProbe {
 public:
  explicit BissProbe(const SpiSettings& spi)
      : spi_(spi), transfer_(ClockedExchange(kTransferBytes, kTransferTimeout)) {
    for (int bits = kMinBits; bits <= kSaaBits; ++bits) fits_[bits];
  }

  [[nodiscard]] std::vector<ProbeHit> Findings() const override {
    const std::vector<int> fitting = Fitting();
    if (fitting.empty()) return {};
    // Of several the longest frame explains most of what came.
    return {FindingOf(fitting.back(), fitting.size() == 1)};
  }
  [[nodiscard]] double Progress() const override { return static_cast<double>(asked_) / kTransfers; }

 protected:
  [[nodiscard]] std::optional<Question> Ask() const override {
    if (asked_ >= kTransfers) return std::nullopt;
    return Question{.exchange = transfer_, .quiet = kRest};
  }
  void Evaluate(const Event& event) override {
    ++asked_;
    for (auto& [bits, fit] : fits_) {
      const FrameReader reader({.bits = bits});
      const std::size_t end = 8 * event.bytes.size();
      const Reply reply = reader.ReadTransfer(event.bytes, end, {});
      // Behind the start bit come the fixed 0 and the frame.
      if (reply.error != FrameError::kNone || !IsLowFrom(event.bytes, reply.start + 2 + reader.frame_bits()))
        continue;
      ++(reply.failed || reply.warned ? fit.reported : fit.good);
      fit.positions.insert(reply.counts);
    }
  }

 private:
  // How the transfers read at one resolution.
  struct Fit {
    int good = 0;      // frames with the right check bits, no error bit, and nothing but low behind them
    int reported = 0;  // as good, but with the error or warning bit active
    std::set<std::uint32_t> positions;
  };

  // resolutions that (nearly) every transfer fits
  [[nodiscard]] std::vector<int> Fitting() const {
    std::vector<int> fitting;
    for (const auto& [bits, fit] : fits_) {
      if (fit.good + fit.reported >= kEnough) fitting.push_back(bits);
    }
    return fitting;
  }
  [[nodiscard]] ProbeHit FindingOf(int bits, bool alone) const {
    const Fit& fit = fits_.at(bits);
    const bool healthy = fit.reported == 0;
    const bool turns = fit.positions.size() >= kVaried;
    ProbeHit finding;
    finding.confidence = !alone || !healthy ? Confidence::kPossible
                         : turns            ? Confidence::kSure
                                            : Confidence::kLikely;
    finding.device = Text("BiSS-C encoder of %d bits", bits);
    finding.reason = Text("the check bits of %d of %d frames fit %d bits%s%s%s", fit.good + fit.reported, asked_,
                          bits, alone ? " and no other resolution" : ", and another resolution too",
                          turns ? ", at different positions" : "; the shaft stood still",
                          healthy ? "" : "; it reports an error or a warning");
    if (spi_.mode == kRisingMode) finding.bus = {{"sample_on", "rising"}};
    finding.keys = {{"model", "saa"}, {"bits", std::to_string(bits)}};
    if (!alone || !turns) finding.check = "bits: turn the shaft and scan again, or see the encoder's label";
    return finding;
  }

  SpiSettings spi_;
  Exchange transfer_;
  int asked_ = 0;
  std::map<int, Fit> fits_;  // by resolution
};

}  // namespace
}  // namespace axlecast::biss

namespace axlecast {

std::vector<ProbeTrial> biss_probe(const ProbeScope& scope) {
  std::vector<ProbeTrial> trials;
  const std::vector<std::int64_t> usual = {biss::kDefaultClockHz, biss::kDefaultClockHz / 4};
  for (const std::int64_t clock : scope.rates.empty() ? usual : scope.rates) {
    for (const int mode : {biss::kFallingMode, biss::kRisingMode}) {
      ProbeTrial trial;
      trial.what =
          mode == biss::kFallingMode ? "BiSS-C, sampled on falling edges" : "BiSS-C, sampled on rising edges";
      trial.asks = true;
      trial.spi = {.mode = mode, .clock_hz = clock};
      trial.longest = biss::kTransfers * (2 * biss::kRest);
      trial.make = [spi = trial.spi](MonoNs) { return std::make_unique<biss::BissProbe>(spi); };
      trials.push_back(std::move(trial));
    }
  }
  return trials;
}

}  // namespace axlecast
