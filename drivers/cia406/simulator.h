#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "core/base/result.h"
#include "drivers/kit/simulation/shaft.h"
#include "drivers/kit/simulation/simulated_can_node.h"
#include "drivers/kit/simulation/unit_simulator.h"

namespace axlecast::cia406 {

// The object dictionary of a simulated CANopen device (CiA 301 7.4).
class SimulatedDictionary {
 public:
  using Place = std::pair<std::uint16_t, std::uint8_t>;  // index, sub-index
  struct Object {
    std::uint8_t bytes = 0;  // 1, 2, 4; 0: a text, longer than an expedited transfer holds
    bool writable = false;
    std::uint32_t value = 0;  // of a text its length
  };

  void Add(Place place, const Object& object) { objects_[place] = object; }
  void AddRecord(std::uint16_t index, std::uint8_t highest_sub);  // its sub-index 0

  // Returns the object; null if it does not exist.
  [[nodiscard]] const Object* Find(Place place) const;
  // Returns the abort code of table 22 for an object that does not exist.
  [[nodiscard]] std::uint32_t MissingCode(Place place) const;
  // Sets the value of an object that exists, also of one that a client may only read.
  void Put(Place place, std::uint32_t value);
  // Returns the value; 0 if the object does not exist.
  [[nodiscard]] std::uint32_t Get(Place place) const;
  // "1017:00=500" sets an object, "1018:04=none" removes it. The error states what would be right.
  [[nodiscard]] Result<> Change(std::string_view text);

 private:
  std::map<Place, Object> objects_;
};

// The measuring part of a simulated encoder: a position value of `bits` a turn and `turn_bits` turns, as in object 6004h of
// CiA 406.
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
  // Makes the position at `at` read `value`.
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

// A CANopen encoder as CiA 301 and CiA 406 describe it, written from these and not from the driver: NMT state machine,
// boot-up, heartbeat, SDO server for expedited transfers, TPDO1 by event timer or SYNC, emergency messages, preset, stored
// parameters. It ignores what a device ignores, and counts it.
class Cia406Node final : public TableDevice<Cia406Node, SimulatedCanNode> {
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

  [[nodiscard]] bool present() const override { return state_ != NodeState::kOff; }
  [[nodiscard]] std::int64_t bitrate() const override { return static_cast<std::int64_t>(bitrate_); }
  void OnFrame(const CanFrame& frame, MonoNs now) override;
  [[nodiscard]] MonoNs NextDue() const override;
  void OnDue(MonoNs now, const Send& send) override;
  [[nodiscard]] QuantityList State(MonoNs now) const override;
  [[nodiscard]] static const QuantityTable<Cia406Node>& Table();

  // Counted since the start.
  struct Counters {
    std::int64_t positions = 0;    // TPDO1 sent
    std::int64_t requests = 0;     // accepted SDO requests
    std::int64_t aborts = 0;       // sent
    std::int64_t aborted = 0;      // by the client
    std::int64_t overlapping = 0;  // requests that came before the last was answered
    std::int64_t ignored = 0;      // frames to this node that no device would accept
    std::int64_t syncs = 0;
    std::int64_t resets = 0;
    std::int64_t presets = 0;
    std::int64_t saves = 0;
  };
  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  using Place = SimulatedDictionary::Place;
  // Table 38 and 7.3.2.2.
  enum class NodeState : std::uint8_t { kOff, kBooting, kStopped = 4, kOperational = 5, kPreOperational = 0x7F };
  static constexpr std::array kNodeStates = {NodeState::kPreOperational, NodeState::kOperational,
                                             NodeState::kStopped, NodeState::kOff, NodeState::kBooting};

  void PowerUp() override { Boot(true); }
  void PowerDown();
  void Boot(bool application);
  void EnterPreOperational(MonoNs at);
  void OnNmt(Bytes data, MonoNs now);
  void OnSync(MonoNs now);
  void OnSdo(Bytes data, MonoNs now);
  void Upload(Place place, MonoNs now);
  void Download(Place place, Bytes data, MonoNs now);
  // Returns 0, or the abort code if the value cannot be written.
  [[nodiscard]] std::uint32_t Write(Place place, std::uint32_t value, MonoNs now);
  void Answer(std::uint8_t command, Place place, std::uint32_t value, MonoNs at);
  void Abort(Place place, std::uint32_t code, MonoNs now);
  void SendPosition(MonoNs sampled);
  void SendEmergency();
  void QueueLate(MonoNs due, const CanFrame& frame);
  void RestartTimers(MonoNs from);
  [[nodiscard]] MonoNs SlowTime(double usual_us) const;
  [[nodiscard]] std::uint32_t AnswerId() const { return 0x580U + setup_.node; }

  void PutBoth(Place place, std::uint32_t value);
  [[nodiscard]] Result<> SetFault(std::string_view text);
  [[nodiscard]] Result<> SetPower(std::string_view text);
  [[nodiscard]] Result<> SetObject(std::string_view text);
  [[nodiscard]] Result<> SetBits(std::uint16_t index, std::string_view text);
  [[nodiscard]] Result<> SetEmergency(std::string_view text);
  [[nodiscard]] Result<> SetNmt(std::string_view text);
  [[nodiscard]] std::string NmtText() const;

  const Setup setup_;
  NodeState state_ = NodeState::kBooting;
  SimulatedDictionary dictionary_;
  SimulatedDictionary stored_;  // what a reset restores
  SimulatedShaftEncoder encoder_;
  std::uint32_t stored_offset_ = 0;
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
  Counters counters_;
};

}  // namespace axlecast::cia406
