#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "drivers/kit/asking_probe.h"

namespace axlecast::saa_modbus {

// Asks one address after the other for its position: one register, which encoders of up to 16 bits answer, then two,
// which the others do. Who answers is asked twice more, and then for an input register, which every SAA encoder leaves
// unanswered and another Modbus device refuses at least. Function 03 and 04 alone: nothing is ever written.
class SaaModbusProbe final : public AskingProbe {
 public:
  // Addresses `first` to `last`, both included.
  SaaModbusProbe(const LineFormat& line, int first, int last)
      : line_(line), first_(first), last_(last), address_(first) {}

  [[nodiscard]] std::vector<ProbeHit> Findings() const override { return findings_; }
  [[nodiscard]] double Progress() const override;

 protected:
  [[nodiscard]] std::optional<Question> Ask() const override;
  void Judge(const Event& event) override;

 private:
  enum class Stage : std::uint8_t { kOneRegister, kTwoRegisters, kConfirm, kForeign };

  [[nodiscard]] Frame Request() const;
  void JudgePosition(const Event& event);
  void JudgeForeign(const Event& event);
  void Go(Stage stage);
  void NextAddress();
  void AddEncoder();
  void AddStranger(const char* why);

  LineFormat line_;
  int first_;
  int last_;
  int address_;
  Stage stage_ = Stage::kOneRegister;
  int registers_ = 1;  // that it answers
  int tries_ = 0;      // in this stage
  int confirmed_ = 0;
  std::uint32_t positions_ = 0;  // every bit that was ever set
  std::size_t reply_size_ = 0;   // bytes of its last answer
  std::vector<ProbeHit> findings_;
};

}  // namespace axlecast::saa_modbus

namespace axlecast {

// For FamilyProbes.
[[nodiscard]] std::vector<ProbeTrial> saa_modbus_probe(const ProbeScope& scope);

}  // namespace axlecast
