#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "core/device/device.h"
#include "drivers/kit/command_runner.h"
#include "drivers/kit/stream.h"
#include "drivers/saa_serial/operations.h"
#include "drivers/saa_serial/reading.h"

namespace axlecast::saa_serial {

// Evaluates what the encoder sends and reports samples, errors by kind, and jumps of the position by clearing to zero.
// The reports depend only on the events, not on the reason for a request: a recorded sequence of events gives the same
// reports again.
class Interpreter {
 public:
  Interpreter(const BusConfig& bus, const SaaSettings& settings, DeviceOutput& output);

  void OnLinkUp(MonoNs now);
  // `zeroing`: the request to clear to zero was under way.
  void OnLinkDown(bool zeroing, MonoNs now);
  // Any other event. Afterwards Next, until it has nothing left: it reports each reading to the output.
  void Take(const Event& event);
  [[nodiscard]] std::optional<Reading> Next();

  // Returns whether the encoder answers: from the first good frame after the link came up, until the stream is silent, or
  // two consecutive requests brought not a single byte.
  [[nodiscard]] bool answering() const { return answering_; }
  // How long to wait for an idle line before the next request; 0: the line is free.
  [[nodiscard]] MonoNs quiet_needed() const { return quiet_needed_; }
  // Returns when the stream counts as silent.
  [[nodiscard]] MonoNs silent_at() const { return cadence_.due(); }
  // A reading sampled at or after this instant shows the effect of the last clearing to zero.
  [[nodiscard]] MonoNs effect_from() const { return effect_from_; }

 private:
  void OnStream(const Event& event);
  void OnPolled(const Event& event);
  void OnStray(const Event& event);
  void BeginJump(MonoNs now);
  void Update(const Reading& reading);
  [[nodiscard]] std::optional<Reading> NextOfStream();

  const Mode mode_;
  const SaaSettings& settings_;
  const bool guards_line_;  // of all devices on the bus, the one that asks for silence after stray bytes
  const MonoNs character_;  // 0 where the wire is simulated
  const StreamTimes times_;
  DeviceOutput& output_;

  StreamParser parser_;
  StalledFrames stalled_;
  PeriodMonitor cadence_;
  MonoNs emptied_ = 0;             // all bytes from before this instant had been read then
  bool all_read_ = true;           // by the newest read
  std::optional<Reading> polled_;  // until Next hands it over

  bool answering_ = false;
  int silent_in_a_row_ = 0;
  MonoNs quiet_needed_ = 0;
  bool jumping_ = false;
  MonoNs effect_from_ = 0;
};

// One encoder of the SAA series on an asynchronous line. Selects when to listen, to pulse or to send a request; the
// Interpreter evaluates the replies.
//
// - Mode timing: listens all the time, and transmits only a pulse on CLR.
// - Modes handshake and bus: one exchange in each live slot. A reading that failed is not repeated. After an unclear
//   exchange, the line must be idle first, so that a late reply meets no other request.
class SaaDevice final : public CommandDevice<Procedure> {
 public:
  SaaDevice(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output);

  [[nodiscard]] Step Next(const BusSlot& slot) const override;
  void OnStarted(const Step& step, MonoNs now) override;
  void On(const Event& event) override;
  void Begin(const DriverCommand& command, MonoNs now) override;

 private:
  [[nodiscard]] Result<std::unique_ptr<Procedure>> MakeProcedure(const DriverCommand& command,
                                                                 MonoNs now) const override;
  [[nodiscard]] Result<> CheckState(const DriverCommand& command, MonoNs now) const override;
  [[nodiscard]] Step Stream(const BusSlot& slot) const;
  [[nodiscard]] Step Poll(const BusSlot& slot, Procedure::Need need) const;
  [[nodiscard]] Exchange AskPosition() const;
  [[nodiscard]] Step ZeroStep() const;
  void OnLinkDown(MonoNs now);
  void AdvanceProcedure(const Event& event);

  std::shared_ptr<const FamilyBus> owned_bus_;  // and bus_
  const SaaBus& bus_;
  const SaaSettings& settings_;
  const LineFormat line_;
  Interpreter interpreter_;

  bool zeroing_ = false;    // the request to clear to zero is under way
  bool live_slot_ = false;  // the last slot was the procedure's: a live reading that is due goes first
};

}  // namespace axlecast::saa_serial
