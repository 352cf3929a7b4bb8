#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/device/simulator.h"
#include "drivers/kit/simulation/shaft.h"
#include "drivers/kit/simulation/simulated_can_node.h"
#include "drivers/kit/simulation/unit_simulator.h"

namespace axlecast::saa_can {

// An SAA encoder on CAN as the maker's manual describes it (5.4.1), written from the manual and not from the driver:
// cyclic and requested positions, zero, direction, rate, and the dialogue on 7E5 that every node obeys. It drops unknown
// frames and counts them. Where the manual states nothing, it does what is harder for a driver:
//
// - When it is switched on, it sends one position ("the software will automatically receive a data") and no other until
//   it is started.
// - It accepts only commands of 8 bytes, with its own NN in D1 and 0 after the printed bytes.
// - Its period is 6.4 % longer than the one that was set, as in the manual's log.
// - It stays in configuration mode until 04 00 comes (CiA 305) or its power goes.
class SaaNode final : public TableDevice<SaaNode, SimulatedCanNode> {
 public:
  struct Setup {
    std::uint8_t node = 0x20;
    int bits = 14;
    bool big_endian = false;
    std::int64_t bitrate = 250'000;
    double period_ms = 100;
    bool cyclic = true;
    // The bytes that the manual leaves out; -1: the command is accepted and does nothing.
    int positive = -1;
    int negative = -1;
    int stop = -1;
    ShaftAngle angle = 0;
    std::uint64_t seed = 1;
  };
  explicit SaaNode(const Setup& setup);

  [[nodiscard]] bool present() const override { return powered_; }
  [[nodiscard]] std::int64_t bitrate() const override { return bitrate_; }
  void OnFrame(const CanFrame& frame, MonoNs now) override;
  [[nodiscard]] MonoNs NextDue() const override;
  void OnDue(MonoNs now, const Send& send) override;
  [[nodiscard]] QuantityList State(MonoNs now) const override;
  [[nodiscard]] static const QuantityTable<SaaNode>& Table();

  // Counted since the start.
  struct Counters {
    std::int64_t positions = 0;  // sent
    std::int64_t requests = 0;   // accepted commands
    std::int64_t replies = 0;    // to commands and in the dialogue
    std::int64_t ignored =
        0;  // commands of another length, node or form than printed; services while not configuring
    std::int64_t unanswered = 0;  // because of a fault
    std::int64_t zeroings = 0;
    std::int64_t changes = 0;  // of node id and bit rate
  };
  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  void PowerUp() override;
  [[nodiscard]] bool Execute(Bytes data, MonoNs now);
  [[nodiscard]] bool SetRate(std::uint8_t per_second, MonoNs now);
  [[nodiscard]] bool ExecuteService(Bytes data, MonoNs now);
  [[nodiscard]] Result<> SetCyclic(std::string_view text);
  [[nodiscard]] Result<> SetFault(std::string_view text);
  [[nodiscard]] Result<> SetPower(std::string_view text);
  void Reply(std::uint32_t id, std::uint8_t code, std::uint8_t result, MonoNs now);
  void QueuePosition(MonoNs due);
  void Transmit(const Pending& pending, const Send& send);
  [[nodiscard]] CanFrame PositionFrame(MonoNs sampled);
  [[nodiscard]] std::uint32_t CountsAt(MonoNs at) const;
  [[nodiscard]] MonoNs Period() const;
  [[nodiscard]] MonoNs ReplyTime() const;

  const Setup setup_;
  Shaft shaft_;
  bool powered_ = true;
  bool running_ = false;        // started since it was switched on
  bool configuration_ = false;  // mode of the dialogue
  std::uint8_t node_;
  std::int64_t bitrate_;
  std::optional<std::uint8_t> next_node_;  // taken at once, or when it is switched on
  std::optional<std::int64_t> next_bitrate_;
  bool cyclic_;
  double period_ms_;
  double stretch_ = 1.064;
  bool negative_ = false;
  ShaftAngle zero_ = 0;
  ShaftAngle stuck_at_ = 0;

  double reply_us_ = 300;
  double processing_us_ = 200;
  double noise_counts_ = 0;
  double zero_error_deg_ = 0;
  double length_ = 8;            // of position frames
  bool replies_on_7e4_ = false;  // in the dialogue
  bool changes_at_power_on_ = false;

  MonoNs next_position_ = kNever;
  Counters counters_;
};

// The nodes on one simulated CAN bus, and the bus between them and the host. Each frame reaches all other nodes that run
// at the same bit rate. It is acknowledged if there is one.
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
  [[nodiscard]] QuantityList State(std::string_view device, MonoNs now) const override;

  [[nodiscard]] const SimulatedCanNode& node(std::size_t unit) const { return *units_[unit].node; }

 private:
  // Frames of a node that the host's adapter holds back: fault `late`.
  struct Held {
    MonoNs due = 0;
    CanPacket packet = {};
  };
  struct ToHost {
    LateAdapter adapter;
    std::deque<Held> held;
  };

  [[nodiscard]] std::int64_t RateOf(const SimulatedCanNode& node) const;
  // Passes the frame of `from`, null for the host, to the other nodes. Returns whether one of them received it.
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
