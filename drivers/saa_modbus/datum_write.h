#pragma once

#include <string>

#include "core/device/device.h"
#include "drivers/saa_modbus/procedure.h"
#include "drivers/saa_modbus/settings.h"

namespace axlecast::saa_modbus {

// Sets the position to zero or the counting direction (CC 00, 01, 02): a reading, the request once, a reading. The
// shaft must stand still before the first reading and before the request. The encoder's echo says that the setting
// was accepted (SAA manual 5.1.7: "Sending a return match ... was set successfully"); a zero is verified by
// reading, a direction cannot be without motion.
class DatumWrite final : public Procedure {
 public:
  // `parameter`: kZero, kPositive or kNegative.
  DatumWrite(Parameter parameter, const SaaModbusSettings& settings, const Connection& connection,
             const DeviceOutput& output);

  [[nodiscard]] Want Next(MonoNs now) const override;
  std::optional<Outcome> OnStarted(Bytes request, MonoNs now) override;
  std::optional<Outcome> OnAnswer(const Answer& answer, MonoNs end) override;
  [[nodiscard]] Outcome OnLinkLost() const override;
  [[nodiscard]] bool touched() const override { return sent_; }

  // A zero whose effect does not show yet is read again.
  static constexpr MonoNs kReadAgain = 20 * kMillisecond;
  static constexpr int kLooks = 5;
  // Readings after the request that may fail.
  static constexpr int kReadsAfter = 10;

 private:
  enum class Stage : std::uint8_t { kReadBefore, kSend, kReadAfter };

  [[nodiscard]] bool AtRest(MonoNs now) const;
  [[nodiscard]] bool IsZero(std::int64_t counts) const;
  [[nodiscard]] bool SameBefore() const;
  std::optional<Outcome> OnBefore(const Answer& answer);
  std::optional<Outcome> OnAfter(const Answer& answer, MonoNs end);
  [[nodiscard]] Outcome JudgeZero(std::int64_t counts) const;
  [[nodiscard]] Outcome JudgeDirection(std::int64_t counts) const;
  [[nodiscard]] Outcome WithCounts(Outcome outcome, const std::string& after) const;

  const Parameter parameter_;
  const SaaModbusSettings& settings_;
  const Connection& connection_;
  const DeviceOutput& output_;
  Stage stage_ = Stage::kReadBefore;
  MonoNs due_ = 0;
  std::int64_t before_ = 0;
  bool sent_ = false;
  bool accepted_ = false;  // the echo came
  int failures_ = 0;
  int looks_ = 0;
};

}  // namespace axlecast::saa_modbus
