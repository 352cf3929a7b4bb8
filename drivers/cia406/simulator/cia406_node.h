#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/cia406/simulator/simulated_dictionary.h"
#include "drivers/kit/simulation/script.h"
#include "drivers/kit/simulation/shaft.h"
#include "drivers/kit/simulation/simulated_can_node.h"
#include "drivers/kit/simulation/simulated_fault.h"

namespace axlecast::cia406 {

// The measuring part of a simulated encoder: a position value of `bits` a turn and `turn_bits` turns, as CiA 406
// has it in 6004h.
struct SimulatedShaftEncoder {
  int bits = 13;
  int turn_bits = 12;
  bool ccw = false;  // counts rise counter-clockwise: code sequence, bit 0 of 6000h
  Shaft shaft;
  std::uint32_t offset = 0;  // 6509h: what a preset adds
  double noise_counts = 0;
  bool stuck = false;
  ShaftAngle stuck_at = 0;

  [[nodiscard]] std::uint64_t range() const { return std::uint64_t{1} << static_cast<unsigned>(bits + turn_bits); }
  [[nodiscard]] std::uint32_t Position(MonoNs at) const {
    return static_cast<std::uint32_t>((Measured(at) + offset) & (range() - 1));
  }
  [[nodiscard]] std::uint32_t NoisyPosition(MonoNs at, SeededRandom& random) const {
    const auto bound = static_cast<std::int64_t>(noise_counts);
    const std::int64_t error = bound == 0 ? 0 : random.Around(bound);
    return static_cast<std::uint32_t>((Position(at) + static_cast<std::uint64_t>(error)) & (range() - 1));
  }
  // The position at `at` reads `value` from here on.
  void Preset(std::uint32_t value, MonoNs at) {
    offset = static_cast<std::uint32_t>((value - Measured(at)) & (range() - 1));
  }

 private:
  [[nodiscard]] std::uint64_t Measured(MonoNs at) const {
    const ShaftAngle angle = stuck ? stuck_at : shaft.At(at).angle;
    const std::int64_t counts = (ccw ? angle : -angle) >> static_cast<unsigned>(kTurnBits - bits);
    return static_cast<std::uint64_t>(counts);
  }
};

// A CANopen encoder as CiA 301 and CiA 406 describe it, written from these and not from the driver: NMT state
// machine, boot-up, heartbeat, SDO server for expedited transfers, TPDO1 by event timer or SYNC, emergency
// messages, preset, stored parameters. It ignores what a device ignores, and counts it.
class Cia406Node final : public SimulatedCanNode {
 public:
  struct Setup {
    std::uint8_t node = 1;
    int bits = 13;
    int turn_bits = 12;
    bool ccw = false;
    std::uint32_t cob_id = 0x181;
    std::uint8_t transmission = 254;  // 1800h sub 2
    std::uint16_t timer_ms = 100;     // 1800h sub 5
    std::uint16_t heartbeat_ms = 0;   // 1017h
    std::array<std::uint32_t, 4> identity{};
    ShaftAngle angle = 0;
    std::uint64_t seed = 1;
  };
  explicit Cia406Node(const Setup& setup);
  void SetScript(Script script) { script_ = std::move(script); }

  [[nodiscard]] bool present() const override { return state_ != NodeState::kOff; }
  [[nodiscard]] std::int64_t bitrate() const override { return static_cast<std::int64_t>(bitrate_); }
  [[nodiscard]] const SimulatedFault& fault() const override { return fault_; }
  void OnFrame(const CanFrame& frame, MonoNs now) override;
  [[nodiscard]] MonoNs NextDue() const override;
  void OnDue(MonoNs now, const Send& send) override;
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> State(MonoNs now) const override;

  void Advance(MonoNs now) override;
  [[nodiscard]] Result<> Set(std::string_view name, std::string_view value) override;
  [[nodiscard]] static const std::vector<std::string_view>& QuantityNames();

  // What was done to it since the start.
  struct Counters {
    std::int64_t positions = 0;    // TPDO1 sent
    std::int64_t requests = 0;     // SDO requests taken
    std::int64_t aborts = 0;       // sent
    std::int64_t aborted = 0;      // by the client
    std::int64_t overlapping = 0;  // requests that came before the last was answered
    std::int64_t ignored = 0;      // frames to this node that no device would take
    std::int64_t syncs = 0;
    std::int64_t resets = 0;
    std::int64_t presets = 0;
    std::int64_t saves = 0;
  };
  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  friend struct NodeQuantities;
  // Table 38 and 7.3.2.2.
  enum class NodeState : std::uint8_t { kOff, kBooting, kStopped = 4, kOperational = 5, kPreOperational = 0x7F };
  struct Pending {
    MonoNs due = 0;
    CanFrame frame;
    bool answer = false;  // of the SDO server
  };

  void CatchUp(MonoNs now);
  void Power(bool on);
  void Boot(bool application);
  void EnterPreOperational(MonoNs at);
  void OnNmt(const CanFrame& frame, MonoNs now);
  void OnSync(MonoNs now);
  void OnSdo(const CanFrame& frame, MonoNs now);
  void Upload(std::uint16_t index, std::uint8_t sub, MonoNs now);
  void Download(const CanFrame& frame, MonoNs now);
  [[nodiscard]] std::uint32_t Write(std::uint16_t index, std::uint8_t sub, std::uint32_t value, MonoNs now);
  void Answer(std::uint8_t command, std::uint16_t index, std::uint8_t sub, std::uint32_t value, MonoNs at);
  void Abort(std::uint16_t index, std::uint8_t sub, std::uint32_t code, MonoNs now);
  void SendPosition(MonoNs sampled);
  void SendEmergency();
  void Queue(MonoNs due, const CanFrame& frame, bool answer = false);
  void RestartTimers(MonoNs from);
  [[nodiscard]] std::uint32_t Value(std::uint16_t index, std::uint8_t sub, MonoNs now);
  [[nodiscard]] MonoNs AnswerTime() const;

  const Setup setup_;
  Script script_;
  bool started_ = false;
  MonoNs now_ = 0;
  NodeState state_ = NodeState::kBooting;
  SimulatedDictionary dictionary_;
  SimulatedDictionary stored_;  // what a reset brings back
  SimulatedShaftEncoder encoder_;
  std::uint32_t stored_offset_ = 0;
  SeededRandom random_;
  SimulatedFault fault_;
  std::string motion_ = "constant";
  double bitrate_ = 0;
  double boot_ms_ = 50;
  double answer_us_ = 500;
  double processing_us_ = 200;
  double save_ms_ = 300;
  std::uint16_t emergency_ = 0;

  MonoNs boot_due_ = kNever;
  MonoNs heartbeat_due_ = kNever;
  MonoNs position_due_ = kNever;
  std::uint8_t syncs_ = 0;  // since the last synchronous position
  bool answering_ = false;
  std::vector<Pending> pending_;
  Counters counters_;
};

}  // namespace axlecast::cia406
