#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/device/device.h"
#include "tests/support/scripted_link.h"

namespace axlecast {

// A little encoder for tests of the runtime: the request `address`, kind answers with `address`, kind, two bytes of
// counts MSB first, and their sum. After a failed reading it needs 200 us of silence. Every operation is one
// request of kind kTouch; once that was sent, the order can no longer be cancelled.
class PolledDevice final : public Device {
 public:
  static constexpr std::uint8_t kRead = 0x10;
  static constexpr std::uint8_t kSlowRead = 0x20;
  static constexpr std::uint8_t kTouch = 0x30;
  static constexpr std::uint8_t kStop = 0x40;
  static constexpr MonoNs kTimeout = 1 * kMillisecond;
  static constexpr MonoNs kQuiet = 200 * kMicrosecond;

  PolledDevice(std::uint8_t address, DeviceOutput& output) : address_(address), output_(output) {}

  // What it requests besides live readings.
  bool wants_slow = false;
  bool wants_stop = false;
  bool stops_regardless = false;      // its stop goes out on a busy line too
  bool leaves_reserved_turns = true;  // its orders can wait
  MonoNs idle_until = 0;              // requests nothing before

  std::optional<Error> refuses;  // any order

  [[nodiscard]] Step Next(const BusSlot& turn) const override;
  void OnStarted(const Step& step, MonoNs now) override;
  void On(const Event& event) override;
  [[nodiscard]] Result<> Validate(const DriverCommand&, MonoNs) const override {
    return refuses ? Result<>(Failure(*refuses)) : Result<>();
  }
  void Begin(const DriverCommand& order, MonoNs now) override;
  [[nodiscard]] bool Cancel(const CommandId& id, MonoNs now) override;

  // The events that it received, in order.
  std::vector<Event::Kind> told;
  std::vector<std::uint8_t> started;  // kinds of its requests

  // The reply of a device at that address; the counts follow from the number of replies before.
  [[nodiscard]] static std::vector<std::uint8_t> Reply(std::uint8_t address, std::uint8_t kind,
                                                       std::uint16_t counts);

 private:
  [[nodiscard]] Step Ask(std::uint8_t kind, Priority priority) const;
  void OnReply(const Event& event);

  std::uint8_t address_;
  DeviceOutput& output_;
  bool wants_silence_ = false;
  std::optional<CommandId> order_;
  bool touched_ = false;
};

// Devices at any address that answer each request 100 us later with rising counts; `dead` addresses do not.
[[nodiscard]] ScriptedLink::Peer PolledDevices(std::vector<std::uint8_t> dead = {});

}  // namespace axlecast
