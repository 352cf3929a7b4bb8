#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/kit/asking_probe.h"
#include "drivers/tsubaki_sc/register_map.h"

namespace axlecast::tsubaki_sc {

// Asks one address after the other for its status (AI 200 to 204). Who answers is asked for its product code,
// manufacturing number and version. Reads need no login, and nothing is ever written.
class ScProbe final : public AskingProbe {
 public:
  ScProbe(int first, int last) : first_(first), last_(last), address_(first) {}

  [[nodiscard]] std::vector<ProbeHit> Findings() const override { return findings_; }
  [[nodiscard]] double Progress() const override;

 protected:
  [[nodiscard]] std::optional<Question> Ask() const override;
  void Judge(const Event& event) override;

 private:
  void NextAddress();
  void Add();

  int first_;
  int last_;
  int address_;
  std::size_t block_ = 0;  // that is asked for
  int tries_ = 0;
  int answered_ = 0;   // blocks
  std::string named_;  // product code, number and version of the unit
  std::vector<ProbeHit> findings_;
};

}  // namespace axlecast::tsubaki_sc

namespace axlecast {

// For FamilyProbes.
[[nodiscard]] std::vector<ProbeTrial> tsubaki_sc_probe(const ProbeScope& scope);

}  // namespace axlecast
