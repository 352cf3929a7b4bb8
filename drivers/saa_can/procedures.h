#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>

#include "core/base/time.h"
#include "core/device/can.h"
#include "core/device/device.h"
#include "core/device/operation.h"
#include "core/device/step.h"
#include "drivers/kit/command_runner.h"
#include "drivers/saa_can/interpreter.h"
#include "drivers/saa_can/settings.h"

namespace axlecast::saa_can {

// One frame of a procedure on its way onto the bus.
class Delivery {
 public:
  enum class State : std::uint8_t {
    kIdle,
    kStarted,       // about to be handed to the controller
    kRefused,       // the controller's queue is full: the frame is nowhere
    kQueued,        // in the queue
    kNotConfirmed,  // queued for too long. It is sent as soon as any node acknowledges it
    kOnBus,         // acknowledged by a node
  };

  // Waiting for a busy bus takes less than 10 ms: after this time there is no node that acknowledges the frame.
  static constexpr MonoNs kConfirmWithin = 500 * kMillisecond;

  void Start(const CanFrame& frame) {
    frame_ = frame;
    state_ = State::kStarted;
  }
  // Receives any event of the bus.
  void On(const Event& event, MonoNs now);

  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] MonoNs on_bus_at() const { return at_; }
  // Returns when the state must be evaluated again.
  [[nodiscard]] MonoNs due() const { return state_ == State::kQueued ? at_ + kConfirmWithin : kNever; }

 private:
  CanFrame frame_;
  State state_ = State::kIdle;
  MonoNs at_ = 0;  // of the state
};

// The parts of the device that a procedure may read. They outlive the procedure.
struct OperationContext {
  const SaaCanSettings& settings;
  bool bench = false;
  const Interpreter& interpreter;
  const DeviceOutput& output;
};

// One command being carried out. It receives every event of the bus after the Interpreter.
class Procedure : public CommandProcedure {
 public:
  struct Nothing {};
  struct Position {};  // as soon as the encoder sends one, or after a request for one
  using Need = std::variant<Nothing, Position, CanFrame>;
  // Returns what the procedure needs next from the bus.
  [[nodiscard]] virtual Need NextNeed(MonoNs now) const = 0;
  // Returns when the procedure must be evaluated again if nothing happens before.
  [[nodiscard]] virtual MonoNs Due(MonoNs now) const = 0;

  // The frame that it needs is about to be handed to the controller.
  virtual void OnStarted([[maybe_unused]] const CanFrame& frame) {}
  // Returns an outcome: progress, or the final one.
  virtual std::optional<Outcome> On(const Event& event, const Interpreter::Evaluation& evaluation, MonoNs now) = 0;

  // Returns whether nothing else may be transmitted meanwhile.
  [[nodiscard]] virtual bool alone() const { return false; }
  // Returns whether the encoder may run at another bit rate: nothing may be transmitted until the link comes up again.
  [[nodiscard]] virtual bool silences() const { return false; }
};

// Returns the final outcome if the frame did not reach the bus; nothing while it may, or if it did.
[[nodiscard]] std::optional<Outcome> NotDelivered(const Delivery& delivery, const SaaCanSettings& settings);
// Return the final outcome if the link is lost: before the frame that changes something was sent, or after it may have been
// sent. `check`: how the user can see its effect.
[[nodiscard]] Outcome LinkLostBefore();
[[nodiscard]] Outcome LinkLostAfter(const std::string& check);
// Returns the final outcome, FAILED or INDETERMINATE, if something that was expected was not received.
[[nodiscard]] Outcome NotReceived(CommandState state, std::string text);

// Sends one frame once, and waits for its effect. Before the frame it may read a position that shows where the shaft is,
// and verify the standstill again.
class OneFrameProcedure : public Procedure {
 public:
  [[nodiscard]] Need NextNeed(MonoNs now) const override;
  [[nodiscard]] MonoNs Due(MonoNs) const override {
    return delivered() || !touched() ? deadline_ : delivery_.due();
  }
  void OnStarted(const CanFrame& frame) override { delivery_.Start(frame); }
  std::optional<Outcome> On(const Event& event, const Interpreter::Evaluation& evaluation, MonoNs now) override;
  [[nodiscard]] Outcome OnLinkLost() const override;
  [[nodiscard]] bool touched() const override { return delivery_.state() != Delivery::State::kIdle; }

 protected:
  OneFrameProcedure(Command command, std::uint8_t parameter, const OperationContext& context)
      : context_(context), command_(command), parameter_(parameter) {}
  // Reads a position before the frame.
  OneFrameProcedure(Command command, std::uint8_t parameter, const OperationContext& context, MonoNs now);

  // Returns the maximum time from the frame on the bus to its effect.
  [[nodiscard]] virtual MonoNs EffectTimeout() const = 0;
  // Returns the progress that is reported when the frame was on the bus.
  [[nodiscard]] virtual std::optional<Outcome> Progress() const { return std::nullopt; }
  // Any event after the frame was on the bus. Returns the final outcome, if it is known.
  virtual std::optional<Outcome> AfterDelivery(const Event& event, const Interpreter::Evaluation& evaluation,
                                               MonoNs now) = 0;
  // Returns whether the procedure needs a position after the frame.
  [[nodiscard]] virtual bool NeedsPosition(MonoNs) const { return false; }
  // Returns an error if the frame may not be sent at this position.
  [[nodiscard]] virtual Result<> CheckPosition(std::int64_t) const { return {}; }
  // Returns how the user can see the effect of the frame after the link was lost.
  [[nodiscard]] virtual std::string Check() const = 0;
  // Adds what the procedure knows to an outcome after the frame was sent.
  [[nodiscard]] virtual Outcome WithChanges(Outcome outcome) const { return outcome; }

  [[nodiscard]] bool delivered() const { return delivery_.state() == Delivery::State::kOnBus; }
  [[nodiscard]] MonoNs delivered_at() const { return delivery_.on_bus_at(); }
  [[nodiscard]] const char* ReplyText() const { return acknowledged_ ? "its reply came" : "no reply came"; }

  const OperationContext context_;
  MonoNs deadline_ = kNever;   // of the position before the frame, then of the effect
  std::int64_t before_ = 0;    // the position before the frame
  bool acknowledged_ = false;  // a reply came, or a position that looks like it

 private:
  std::optional<Outcome> OnBefore(const Interpreter::Evaluation& evaluation, MonoNs now);

  const Command command_;
  const std::uint8_t parameter_;
  Delivery delivery_;
  const bool reads_before_ = false;
  bool read_ = false;  // the position before the frame
};

// Clears the encoder to zero (20 NN, SAA manual 5.4.1 (3) ⑥). Positions before and after the frame show the effect. The
// reply alone proves nothing: it looks like a position.
class Zero final : public OneFrameProcedure {
 public:
  Zero(const OperationContext& context, MonoNs now) : OneFrameProcedure(Command::kZero, 0, context, now) {}

  [[nodiscard]] MonoNs Due(MonoNs now) const override;

 private:
  [[nodiscard]] MonoNs EffectTimeout() const override;
  [[nodiscard]] std::optional<Outcome> Progress() const override;
  std::optional<Outcome> AfterDelivery(const Event& event, const Interpreter::Evaluation& evaluation,
                                       MonoNs now) override;
  [[nodiscard]] bool NeedsPosition(MonoNs now) const override { return now >= context_.interpreter.effect_from(); }
  [[nodiscard]] std::string Check() const override { return "read_position after=zero"; }
  [[nodiscard]] Outcome WithChanges(Outcome outcome) const override { return WithCounts(std::move(outcome), ""); }
  [[nodiscard]] bool SameBefore() const;
  [[nodiscard]] Outcome Verify(std::int64_t counts) const;
  [[nodiscard]] Outcome WithCounts(Outcome outcome, const std::string& after) const;

  int readings_ = 0;
};

// Sets the counting direction (22 NN, SAA manual 5.4.1 (3) ④⑤) with the byte from the configuration. The reply shows that
// it was accepted; only a motion shows the effect. It is refused where a position of the shaft at rest could be taken for
// the reply.
class SetDirection final : public OneFrameProcedure {
 public:
  SetDirection(std::uint8_t parameter, const OperationContext& context, MonoNs now)
      : OneFrameProcedure(Command::kDirection, parameter, context, now) {}

 private:
  [[nodiscard]] MonoNs EffectTimeout() const override { return context_.settings.reply_window; }
  std::optional<Outcome> AfterDelivery(const Event& event, const Interpreter::Evaluation& evaluation,
                                       MonoNs now) override;
  [[nodiscard]] Result<> CheckPosition(std::int64_t counts) const override;
  [[nodiscard]] std::string Check() const override { return "turn the shaft and see which way it counts"; }
  [[nodiscard]] Outcome WithChanges(Outcome outcome) const override;
};

// Returns an error if the direction cannot be set at this position, because it has the bytes of the reply.
[[nodiscard]] Result<> CheckDirectionAt(std::int64_t counts, const SaaCanSettings& settings);

// The period of frames that an encoder sends by itself, measured from their arrivals.
class PeriodMeter {
 public:
  void Add(MonoNs at) {
    if (frames_++ == 0) first_ = at;
    last_ = at;
  }
  [[nodiscard]] bool done() const { return frames_ > kPeriods; }
  // Returns the mean period; 0 before the second frame.
  [[nodiscard]] MonoNs Mean() const { return frames_ < 2 ? 0 : (last_ - first_) / (frames_ - 1); }
  [[nodiscard]] double MeanMs() const { return static_cast<double>(Mean()) / static_cast<double>(kMillisecond); }
  // Returns whether the mean is within a quarter of the nominal period: the manual's own log is 6.4 % off.
  [[nodiscard]] bool Fits(MonoNs nominal) const {
    const MonoNs off = Mean() > nominal ? Mean() - nominal : nominal - Mean();
    return off * 4 <= nominal;
  }
  // Returns the maximum time of a measurement.
  [[nodiscard]] static MonoNs Timeout(MonoNs nominal) { return 2 * kSecond + 2 * kPeriods * nominal; }

 private:
  static constexpr int kPeriods = 5;

  int frames_ = 0;
  MonoNs first_ = 0;
  MonoNs last_ = 0;
};

// Sets how often the encoder sends by itself (31 NN TT, ⑦), and measures it.
class SetPeriod final : public OneFrameProcedure {
 public:
  SetPeriod(std::uint8_t per_second, const OperationContext& context)
      : OneFrameProcedure(Command::kPeriod, per_second, context), period_(kSecond / per_second) {}

 private:
  [[nodiscard]] MonoNs EffectTimeout() const override {
    return PeriodMeter::Timeout(std::max(period_, context_.interpreter.period()));
  }
  std::optional<Outcome> AfterDelivery(const Event& event, const Interpreter::Evaluation& evaluation,
                                       MonoNs now) override;
  [[nodiscard]] std::string Check() const override;

  const MonoNs period_;
  PeriodMeter meter_;
};

// Stops an encoder that sends by itself (31 NN TT, ⑧) although it is polled, with the byte from the configuration. Then
// nothing is requested for a while, and nothing must be received.
class StopCyclic final : public OneFrameProcedure {
 public:
  StopCyclic(std::uint8_t parameter, const OperationContext& context)
      : OneFrameProcedure(Command::kPeriod, parameter, context) {}

  [[nodiscard]] bool alone() const override { return touched(); }

 private:
  // The time without a position: longer than the longest period, one position a second.
  static constexpr MonoNs kQuiet = 1'500 * kMillisecond;
  // For this time, a position may still come that was requested or on its way.
  static constexpr MonoNs kSettle = 100 * kMillisecond;

  [[nodiscard]] MonoNs EffectTimeout() const override { return kSettle + kQuiet; }
  std::optional<Outcome> AfterDelivery(const Event& event, const Interpreter::Evaluation& evaluation,
                                       MonoNs now) override;
  [[nodiscard]] std::string Check() const override { return "see whether positions come by themselves"; }
};

// A procedure that changes nothing in the encoder.
class ReadProcedure : public Procedure {
 public:
  [[nodiscard]] Outcome OnLinkLost() const override {
    return NotReceived(CommandState::kFailed, "the link was lost before the reading was complete");
  }
  [[nodiscard]] bool reads_only() const override { return true; }
};

// Reads one position. It also shows whether the encoder reads as after the operation that was carried out before.
class ReadPosition final : public ReadProcedure {
 public:
  enum class After : std::uint8_t { kNothing, kZero, kDirection, kBitrate };
  ReadPosition(After after, const OperationContext& context, MonoNs now);

  [[nodiscard]] Need NextNeed(MonoNs) const override { return Position{}; }
  [[nodiscard]] MonoNs Due(MonoNs) const override { return deadline_; }
  std::optional<Outcome> On(const Event& event, const Interpreter::Evaluation& evaluation, MonoNs now) override;

 private:
  [[nodiscard]] const char* Finding(std::int64_t counts, MonoNs now) const;

  const After after_;
  const OperationContext context_;
  const MonoNs deadline_;
};

// Measures how often the encoder sends by itself, to see whether set_period took effect.
class ReadPeriod final : public ReadProcedure {
 public:
  ReadPeriod(MonoNs period, const OperationContext& context, MonoNs now)
      : period_(period), deadline_(now + PeriodMeter::Timeout(std::max(period, context.interpreter.period()))) {}

  [[nodiscard]] Need NextNeed(MonoNs) const override { return Nothing{}; }
  [[nodiscard]] MonoNs Due(MonoNs) const override { return deadline_; }
  std::optional<Outcome> On(const Event& event, const Interpreter::Evaluation& evaluation, MonoNs now) override;

 private:
  const MonoNs period_;
  const MonoNs deadline_;
  PeriodMeter meter_;
};

}  // namespace axlecast::saa_can
