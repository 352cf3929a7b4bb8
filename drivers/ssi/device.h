#pragma once

#include <memory>
#include <optional>

#include "core/device/device.h"
#include "drivers/ssi/codec.h"
#include "drivers/ssi/settings.h"

namespace axlecast::ssi {

// Returns the fault of the line if consecutive transfers fail in the same way; null if they do not indicate one.
[[nodiscard]] const AlarmSpec* LineAlarm(WordError error);

// A status bit as an alarm. Its name is the configured one, and must outlive the alarm.
[[nodiscard]] AlarmSpec StatusAlarm(const StatusBit& bit, std::size_t index);

// One encoder on SSI: one transfer in each live slot. A transfer that failed is not repeated before the next slot. While
// there is no encoder, it is polled less often. SSI carries no commands.
class SsiDevice final : public Device {
 public:
  SsiDevice(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output);

  [[nodiscard]] Step Next(const BusSlot& slot) const override;
  void OnStarted(const Step&, MonoNs) override {}
  void On(const Event& event) override;
  [[nodiscard]] Result<> Validate(const DriverCommand& command, MonoNs now) const override;
  void Begin(const DriverCommand& command, MonoNs now) override;
  [[nodiscard]] bool Cancel(const CommandId&, MonoNs) override { return false; }

 private:
  void OnTransfer(const Event& event);
  void OnWordError(WordError error, Interval at);
  void EndLineAlarm(MonoNs now);
  void OnWord(const Word& word, Interval at);

  std::shared_ptr<const DeviceSettings> owned_;  // keeps settings_ alive
  const SsiSettings& settings_;
  const std::size_t size_;  // bytes of a transfer
  const MonoNs clocking_;   // time of its clocks, at least
  DeviceOutput& output_;

  bool link_up_ = false;
  MonoNs not_before_ = 0;  // there was no encoder
  WordError last_error_ = WordError::kNone;
  int in_a_row_ = 0;                       // transfers that failed with last_error_
  const AlarmSpec* line_alarm_ = nullptr;  // that is up
};

}  // namespace axlecast::ssi
