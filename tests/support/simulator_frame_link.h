#pragma once

#include <cstdint>
#include <deque>
#include <string>

#include "core/device/link.h"
#include "core/device/simulator.h"
#include "tests/support/cable.h"
#include "tests/support/can_transmit_queue.h"
#include "tests/support/fake_clock.h"

namespace axlecast {

// A CAN bus in virtual time to a simulator: sleeping moves the FakeClock from one thing that happens to the next. As with
// a real controller a frame that no node acknowledges is sent again and again, also beyond Close; pulling the interface
// out drops it. Damage changes the data of a frame that comes.
class SimulatorFrameLink final : public FrameLink, public Cable {
 public:
  SimulatorFrameLink(FakeClock& clock, Simulator& simulator, std::int64_t bitrate)
      : clock_(clock), simulator_(simulator), bitrate_(bitrate) {}

  [[nodiscard]] Result<> Open() override;
  void Close() override;
  [[nodiscard]] bool IsOpen() const override { return open_; }
  [[nodiscard]] SendResult Send(const CanFrame& frame) override;
  [[nodiscard]] Status Receive(Received& received) override;
  [[nodiscard]] CanController Controller() override;
  [[nodiscard]] Status Wait(MonoNs until) override;
  void Wake() override {}
  [[nodiscard]] LineErrors Errors() const override { return {}; }

 private:
  [[nodiscard]] bool Gone() const { return !open_ || !plugged(); }
  [[nodiscard]] Simulator::Transmit Arrive();
  void ArriveFrame(const CanFrame& frame, bool own);
  void SendWaiting();
  void RunUntil(MonoNs until);

  FakeClock& clock_;
  Simulator& simulator_;
  const std::int64_t bitrate_;
  bool open_ = false;
  CanTransmitQueue queue_;
  std::deque<Received> received_;
};

}  // namespace axlecast
