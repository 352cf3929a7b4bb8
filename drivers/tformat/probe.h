#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "drivers/kit/asking_probe.h"
#include "drivers/tformat/codec.h"

namespace axlecast::tformat {

// Looks for the one encoder on its line by readouts alone, data ID 3 and 2 in turn: they begin no reset sequence, and
// end one that somebody has left unfinished.
class TFormatProbe final : public AskingProbe {
 public:
  [[nodiscard]] std::vector<ProbeHit> Findings() const override;
  [[nodiscard]] double Progress() const override;

 protected:
  [[nodiscard]] std::optional<Question> Ask() const override;
  void Judge(const Event& event) override;

 private:
  static constexpr int kQuestions = 8;
  static constexpr int kVain = 4;  // of them without any answer: nobody is there

  int asked_ = 0;
  int answered_ = 0;  // without an error, with the same ENID
  int refused_ = 0;   // damaged, or with another ENID than before
  std::optional<std::uint8_t> encoder_id_;
  std::uint32_t positions_ = 0;  // every bit of ABS that was ever set
};

}  // namespace axlecast::tformat

namespace axlecast {

// For FamilyProbes.
[[nodiscard]] std::vector<ProbeTrial> tformat_probe(const ProbeScope& scope);

}  // namespace axlecast
