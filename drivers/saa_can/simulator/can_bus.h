#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/device/can.h"
#include "core/device/simulator.h"
#include "drivers/kit/simulation/simulated_can_node.h"
#include "drivers/kit/simulation/simulated_fault.h"

namespace axlecast::saa_can {

// The nodes on one simulated CAN bus, and the bus between them and the host: every frame is heard by all others that
// run at the same bit rate, and acknowledged when there is one.
class CanBus final : public Simulator {
 public:
  struct Unit {
    std::string name;
    std::unique_ptr<SimulatedCanNode> node;
  };
  // `bitrate`: of the bus as configured. `seed`: of the delays of the host's adapter.
  CanBus(std::int64_t bitrate, std::vector<Unit> units, std::uint64_t seed = 1);

  [[nodiscard]] bool OnFrame(const CanFrame& frame, MonoNs now, const Transmit& transmit) override;
  void OnBaud(std::int64_t bitrate) override { host_ = bitrate; }
  [[nodiscard]] MonoNs NextDue() const override;
  void OnDue(MonoNs now, const Transmit& transmit) override;
  [[nodiscard]] Result<> Set(std::string_view device, std::string_view key, std::string_view value,
                             MonoNs now) override;
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> State(std::string_view device,
                                                                       MonoNs now) const override;

  [[nodiscard]] const SimulatedCanNode& node(std::size_t unit) const { return *units_[unit].node; }

 private:
  // What the host's adapter holds back of a node's frames: fault `late`.
  struct Held {
    MonoNs due = 0;
    CanPacket packet = {};
  };
  struct ToHost {
    LateAdapter adapter;
    std::deque<Held> held;
  };

  [[nodiscard]] std::int64_t RateOf(const SimulatedCanNode& node) const;
  // Hands the frame of `from`, null for the host, to the other nodes; whether one of them took it.
  bool Broadcast(const SimulatedCanNode* from, std::int64_t rate, const CanFrame& frame, MonoNs now);
  void Serve(std::size_t unit, MonoNs now, const Transmit& transmit);

  const std::int64_t configured_;
  std::vector<Unit> units_;
  std::vector<ToHost> to_host_;  // of each unit
  SeededRandom random_;
  std::int64_t host_;                // bit rate of the host
  std::int64_t host_frames_ = 0;     // acknowledged
  std::int64_t unacknowledged_ = 0;  // of the host
  std::int64_t unheard_ = 0;         // of a node, with neither host nor node to acknowledge them
};

}  // namespace axlecast::saa_can
