#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <vector>

#include "drivers/kit/asking_probe.h"
#include "drivers/ssi/codec.h"

namespace axlecast::ssi {

// Clocks words out of whatever is there, far more clocks than a word has, and looks whether the word comes again. A word of
// SSI has neither check bits nor an end: little can be known. Nothing but the clock goes out.
class SsiProbe final : public AskingProbe {
 public:
  SsiProbe();

  [[nodiscard]] std::vector<ProbeHit> Findings() const override;
  [[nodiscard]] double Progress() const override;

 protected:
  [[nodiscard]] std::optional<Question> Ask() const override;
  void Judge(const Event& event) override;

 private:
  // How the line behaves behind a word of so many bits, in every transfer so far.
  struct Length {
    int bits = 0;
    bool repeats = true;       // the word comes again at once
    bool zero_repeats = true;  // after one zero
  };

  [[nodiscard]] ProbeHit FindingOf(int bits, AfterWord after) const;

  Exchange transfer_;
  int asked_ = 0;
  int answered_ = 0;  // high before the clock, and neither only ones nor only zeros after
  std::vector<Length> lengths_;
  int last_one_ = 0;  // bits up to the last 1 that was ever seen
  std::set<std::uint64_t> words_;
};

}  // namespace axlecast::ssi

namespace axlecast {

// For FamilyProbes.
[[nodiscard]] std::vector<ProbeTrial> ssi_probe(const ProbeScope& scope);

}  // namespace axlecast
