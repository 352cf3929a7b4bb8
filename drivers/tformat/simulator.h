#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <utility>

#include "drivers/kit/simulation/simulated_fault.h"
#include "drivers/kit/simulation/unit_simulator.h"
#include "drivers/tformat/encoder_model.h"
#include "drivers/tformat/simulator_request.h"

namespace axlecast::tformat {

// When a reply reaches the host.
enum class Pace : std::uint8_t {
  kUnpaced,  // at once
  kWire,     // when its last bit would end on the wire
  kSlots,    // at the next multiple of the slot on CLOCK_MONOTONIC
};

// A simulated encoder and its line, with all that a file, a script or an operator can set.
struct SimulatedAxis final : TableDevice<SimulatedAxis> {
  explicit SimulatedAxis(EncoderModel model) : encoder(std::move(model)) {}

  void Advance(MonoNs now) override { encoder.Advance(now); }
  [[nodiscard]] static const QuantityTable<SimulatedAxis>& Table();
  // Every quantity with its present value, then what the encoder measures and what was done to it.
  [[nodiscard]] QuantityList Quantities() const;

  EncoderModel encoder;
  SimulatedFault fault;
  Pace pace = Pace::kWire;
  double slot_us = 51;         // spec: 4 us request, 3 us, 44 us reply of data ID 3
  bool abnormal_echo = false;  // an abnormal request is answered with its own control field, not with data ID 3's
};

// One encoder on its point-to-point line: takes requests apart as strictly as the maker's tables require, answers in
// the wire's time (3 us after the request, 4 us a byte at 2.5 Mbit/s) and complains when it is addressed while it
// transmits. The instants given to it must not run backwards.
class TFormatSimulator final : public UnitSimulator<ScriptedDevice<SimulatedAxis>> {
 public:
  struct Line {
    bool echo = false;                    // the adapter receives its own transmission
    MonoNs byte_time = 4 * kMicrosecond;  // 10 bits at 2.5 Mbit/s, spec 6.1
    std::uint64_t seed = 1;               // of the faults
    std::int64_t baud = 0;                // of the encoder; 0: whatever the host's is
  };

  TFormatSimulator(std::string device, const SimulatedAxis& axis, Script script, const Line& line);

  void OnBytes(Bytes bytes, MonoNs now, const Transmit& transmit) override;
  void OnBaud(std::int64_t baud) override { baud_fits_ = line_.baud == 0 || baud == line_.baud; }
  [[nodiscard]] MonoNs NextDue() const override;
  void OnDue(MonoNs now, const Transmit& transmit) override;

  // Traffic since the start.
  struct Counters {
    std::int64_t requests = 0;    // well-formed
    std::int64_t replies = 0;     // handed to the line, damaged or not
    std::int64_t abnormal = 0;    // answered with data ID 3's data
    std::int64_t bad_sync = 0;    // bytes that began no frame
    std::int64_t unanswered = 0;  // off, in standby, or by a fault
    std::int64_t collisions = 0;  // addressed while it transmits: a real interface circuit may be destroyed
    std::int64_t noise = 0;       // bytes at another baud rate
    std::int64_t writes = 0;      // requests that change something in the encoder, resets and the EEPROM
  };
  [[nodiscard]] const Counters& counters() const { return counters_; }
  [[nodiscard]] const EncoderModel& encoder() const { return axis().encoder; }

 private:
  static constexpr std::size_t kLongestRequest = 4;
  static constexpr std::size_t kLongestReply = 11;
  static constexpr std::size_t kMaxPending = 32;
  using ReplyBytes = InlineBytes<kLongestReply>;
  struct Pending {
    MonoNs due = kNever;            // the host gets it
    MonoNs on_wire_until = kNever;  // the encoder has sent it
    ReplyBytes bytes;
  };

  using Unit = ScriptedDevice<SimulatedAxis>;
  [[nodiscard]] CounterList CountersOf(const Unit& unit) const override;
  [[nodiscard]] SimulatedAxis& axis() { return units().front().device; }
  [[nodiscard]] const SimulatedAxis& axis() const { return units().front().device; }
  [[nodiscard]] bool Listens(MonoNs now) const;
  void FinishFrame(MonoNs now, const Transmit& transmit);
  void Take(Bytes bytes, bool delimiter_error, MonoNs now, const Transmit& transmit);
  void Answer(const SimulatedRequest& request, MonoNs now, const Transmit& transmit);
  void Deliver(ReplyBytes reply, MonoNs request_end, MonoNs now, const Transmit& transmit);
  void Collide(MonoNs now);
  void SendDue(MonoNs now, const Transmit& transmit);
  void Send(const ReplyBytes& reply, const Transmit& transmit);

  [[nodiscard]] ReplyBytes Execute(const SimulatedRequest& request, MonoNs at);
  [[nodiscard]] ReplyBytes PositionReply(std::uint8_t field, std::uint8_t data_id, std::uint8_t alarm_bits,
                                         MonoNs at);
  [[nodiscard]] ReplyBytes EepromReply(const SimulatedRequest& request, MonoNs at);

  Line line_;
  SeededRandom random_;
  Counters counters_;

  bool baud_fits_ = true;
  InlineBytes<kLongestRequest> frame_;  // of a request that has begun
  MonoNs frame_ends_ = kNever;          // no further byte until then: the request ends as it is
  bool delimiter_error_ = false;        // in that request
  MonoNs transmitting_until_ = INT64_MIN;
  std::array<Pending, kMaxPending> pending_;
  MonoNs next_pending_ = kNever;
  LateAdapter adapter_;
};

}  // namespace axlecast::tformat
