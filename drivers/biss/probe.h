#pragma once

#include <map>
#include <set>
#include <vector>

#include "drivers/biss/codec.h"
#include "drivers/kit/asking_probe.h"

namespace axlecast::biss {

// Clocks frames out of whatever is there, and looks at which resolution their check bits fit: x^6 + x + 1, single-turn, as
// the SAA encoders have it. Nothing but the clock goes out.
class BissProbe final : public AskingProbe {
 public:
  explicit BissProbe(const SpiSettings& spi);

  [[nodiscard]] std::vector<ProbeHit> Findings() const override;
  [[nodiscard]] double Progress() const override;

 protected:
  [[nodiscard]] std::optional<Question> Ask() const override;
  void Judge(const Event& event) override;

 private:
  // How the transfers read at one resolution.
  struct Fit {
    int good = 0;      // frames with the right check bits, no error bit, and nothing but low behind them
    int reported = 0;  // as good, but with the error or warning bit active
    std::set<std::uint32_t> positions;
  };

  [[nodiscard]] std::vector<int> Fitting() const;  // resolutions that (nearly) every transfer fits
  [[nodiscard]] ProbeHit FindingOf(int bits, bool alone) const;

  SpiSettings spi_;
  Exchange transfer_;
  int asked_ = 0;
  std::map<int, Fit> fits_;  // by resolution
};

}  // namespace axlecast::biss

namespace axlecast {

// For FamilyProbes.
[[nodiscard]] std::vector<ProbeTrial> biss_probe(const ProbeScope& scope);

}  // namespace axlecast
