#pragma once

#include <axlecast/alarm_entry_t.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "core/device/device.h"
#include "drivers/biss/codec.h"
#include "drivers/biss/settings.h"
#include "drivers/kit/command_runner.h"

namespace axlecast::biss {

// The two status bits of every frame (SAA manual 5.6), both active low. What is behind them is the maker's.
inline constexpr AlarmSpec kErrorAlarm = {
    0x100, alarm_entry_t::SOURCE_DEVICE, alarm_entry_t::SEVERITY_CRITICAL, "error",
    "The position is not valid: check supply, speed and mounting; replace the encoder"};
inline constexpr AlarmSpec kWarningAlarm = {
    0x101, alarm_entry_t::SOURCE_DEVICE, alarm_entry_t::SEVERITY_WARNING, "warning",
    "The encoder nears a limit (dirt, ageing, temperature): see its data sheet"};

inline constexpr std::string_view kReadPositionName = "read_position";
[[nodiscard]] std::span<const OperationSpec> Operations();

// read_position: shows the next frame, or fails after five transfers without one.
class PositionReadout final : public CommandProcedure {
 public:
  // `settings` outlives it.
  explicit PositionReadout(const BissSettings& settings) : settings_(settings) {}

  [[nodiscard]] Outcome OnFrame(const Reply& reply) const;
  // A transfer brought no frame. Returns the outcome if it was the last attempt.
  std::optional<Outcome> OnFailure(ErrorKind error);
  [[nodiscard]] Outcome OnLinkLost() const override;

 private:
  const BissSettings& settings_;
  int attempts_ = 0;
};

// One encoder on BiSS-C, point to point: one transfer in each slot. The pause between transfers, in which the encoder
// sees that a frame is over, is the bus's pacing.
//
// - A failed reading is not repeated: the next slot brings another.
// - Every frame is complete within its transfer, so that no late reply can be mistaken for an answer.
// - A frame whose start bit is at another place than in the frame before is refused until the next frame confirms the
//   place. One wrong sample can hide the start bit or look like one, and one in 64 shifted frames passes the check.
// - While no encoder answers, it is polled ten times a second.
class BissDevice final : public CommandDevice<PositionReadout> {
 public:
  BissDevice(const DeviceConfig& device, DeviceOutput& output);

  [[nodiscard]] Step Next(const BusSlot& slot) const override;
  void OnStarted(const Step& step, MonoNs now) override;
  void On(const Event& event) override;

 private:
  [[nodiscard]] Result<std::unique_ptr<PositionReadout>> MakeProcedure(const DriverCommand& command,
                                                                       MonoNs now) const override;
  // A transfer without a frame is what read_position reports: an encoder that does not answer is no reason to refuse.
  [[nodiscard]] Result<> CheckState(const DriverCommand&, MonoNs) const override { return {}; }
  void OnTransfer(const Event& event);
  [[nodiscard]] bool StartIsBelieved(std::size_t start);
  void OnFrame(const Reply& reply, const Event& event);
  void ReportAlarms(const Reply& reply, MonoNs now);
  [[nodiscard]] Interval LatchInstant(const Event& event) const;

  const BissSettings& settings_;
  const FrameReader reader_;
  const MonoNs half_cycle_;
  const MonoNs on_wire_;  // from the first rising edge of a transfer to its last, at least
  Exchange transfer_;

  std::optional<std::size_t> start_;    // of the last frame believed
  std::optional<std::size_t> doubted_;  // of one since then that was not
  std::optional<Reply> before_;         // the good frame before
  int unanswered_ = 0;                  // transfers in a row that nobody acknowledged
  MonoNs not_before_ = 0;               // of a live reading
  std::optional<bool> failed_;          // as last reported by the alarm
  std::optional<bool> warned_;
};

// Why a transfer gave no position, as device_info_t counts it.
[[nodiscard]] ErrorKind KindOf(FrameError error);

}  // namespace axlecast::biss
