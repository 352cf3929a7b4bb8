#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/kit/simulation/script.h"
#include "drivers/kit/simulation/shaft.h"
#include "drivers/kit/simulation/simulated_can_node.h"
#include "drivers/kit/simulation/simulated_fault.h"

namespace axlecast::saa_can {

// An SAA encoder on CAN as the maker's manual describes it (5.4.1), written from that and not from the driver:
// positions by itself and on request, zero, direction, rate, and the dialogue on 7E5 that every node takes. It drops
// what it does not know, and counts it. Where the manual is silent it does what is harder for a driver:
//
// - switched on, it sends one position ("the software will automatically receive a data") and no other until it is
//   started;
// - it takes commands of 8 bytes only, with its own NN in D1 and 0 behind what is printed;
// - its period is 6.4 % longer than what is set, as in the manual's log;
// - in configuration mode it stays until 04 00 comes (CiA 305) or its power goes.
class SaaNode final : public SimulatedCanNode {
 public:
  struct Setup {
    std::uint8_t node = 0x20;
    int bits = 14;
    bool big_endian = false;
    std::int64_t bitrate = 250'000;
    double period_ms = 100;
    bool cyclic = true;
    // The bytes that the manual leaves out; -1: the command is taken and does nothing.
    int positive = -1;
    int negative = -1;
    int stop = -1;
    ShaftAngle angle = 0;
    std::uint64_t seed = 1;
  };
  explicit SaaNode(const Setup& setup);
  void SetScript(Script script) { script_ = std::move(script); }

  [[nodiscard]] bool present() const override { return powered_; }
  [[nodiscard]] std::int64_t bitrate() const override { return bitrate_; }
  [[nodiscard]] const SimulatedFault& fault() const override { return fault_; }
  void OnFrame(const CanFrame& frame, MonoNs now) override;
  [[nodiscard]] MonoNs NextDue() const override;
  void OnDue(MonoNs now, const Send& send) override;
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> State(MonoNs now) const override;

  void Advance(MonoNs now) override { now_ = now; }
  [[nodiscard]] Result<> Set(std::string_view name, std::string_view value) override;
  [[nodiscard]] static const std::vector<std::string_view>& QuantityNames();

  // What was done to it since the start.
  struct Counters {
    std::int64_t positions = 0;  // sent
    std::int64_t requests = 0;   // commands taken
    std::int64_t replies = 0;    // to commands and in the dialogue
    std::int64_t ignored = 0;  // commands of another length, node or form than printed, and services while waiting
    std::int64_t unanswered = 0;  // by a fault
    std::int64_t zeroings = 0;
    std::int64_t changes = 0;  // of node id and bit rate
  };
  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  friend struct SaaNodeQuantities;
  struct Pending {
    MonoNs due = 0;
    CanFrame frame;
    bool position = false;  // sampled when it is sent
  };

  void CatchUp(MonoNs now);
  void PowerOn(MonoNs at);
  void OnCommand(const CanFrame& frame, MonoNs now);
  [[nodiscard]] bool Execute(const CanFrame& frame, MonoNs now);
  [[nodiscard]] bool TakePeriod(std::uint8_t per_second, MonoNs now);
  void OnService(const CanFrame& frame, MonoNs now);
  [[nodiscard]] bool Configure(Bytes data, MonoNs now);
  void Answer(std::uint8_t code, MonoNs now);
  void AnswerService(std::uint8_t code, std::uint8_t result, MonoNs now);
  void AnswerPosition(MonoNs now);
  void Say(const Pending& pending, const Send& send);
  void Queue(MonoNs due, const CanFrame& frame, bool position);
  [[nodiscard]] CanFrame PositionFrame(MonoNs sampled);
  [[nodiscard]] std::uint32_t CountsAt(MonoNs at) const;
  [[nodiscard]] MonoNs Period() const;
  [[nodiscard]] MonoNs ReplyTime() const;

  const Setup setup_;
  Script script_;
  bool begun_ = false;
  MonoNs now_ = 0;
  Shaft shaft_;
  SeededRandom random_;
  SimulatedFault fault_;
  std::string motion_ = "constant";

  bool powered_ = true;
  bool running_ = false;        // started since it was switched on
  bool configuration_ = false;  // mode of the dialogue
  std::uint8_t node_;
  std::int64_t bitrate_;
  std::uint8_t next_node_;  // taken up at once, or when it is switched on
  std::int64_t next_bitrate_;
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
  std::vector<Pending> pending_;
  Counters counters_;
};

}  // namespace axlecast::saa_can
