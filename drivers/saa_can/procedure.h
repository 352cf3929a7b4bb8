#pragma once

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
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

inline constexpr MonoNs kMinTimeout = 2 * kSecond;
inline constexpr int kTimeoutPeriods = 10;

// Returns the maximum time for a position: several periods of a slow encoder, or several requests without a reply.
inline MonoNs Timeout(const SaaCanSettings& settings) {
  return std::max(kMinTimeout, kTimeoutPeriods * settings.period);
}

inline long long InMilliseconds(MonoNs time) { return static_cast<long long>(time / kMillisecond); }

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
  void On(const Event& event, MonoNs now) {
    const Bytes data = frame_.data;
    const bool same =
        event.id == frame_.id && std::equal(event.bytes.begin(), event.bytes.end(), data.begin(), data.end());
    if (state_ == State::kStarted && same && event.kind == Event::Kind::kSent) {
      state_ = State::kQueued;
      at_ = now;
    } else if (state_ == State::kStarted && same && event.kind == Event::Kind::kNotSent) {
      state_ = State::kRefused;
    } else if (state_ == State::kQueued && same && event.kind == Event::Kind::kConfirmed) {
      state_ = State::kOnBus;
      at_ = now;
    } else if (state_ == State::kQueued && now >= due()) {
      state_ = State::kNotConfirmed;
    }
  }

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

// Returns the final outcome, FAILED or INDETERMINATE, if something that was expected was not received.
inline Outcome NotReceived(CommandState state, std::string text) {
  return Final(state, command_status_t::REASON_NO_REPLY, std::move(text));
}

// Returns the final outcome if the frame did not reach the bus; nothing while it may, or if it did.
inline std::optional<Outcome> NotDelivered(const Delivery& delivery, const SaaCanSettings& settings) {
  if (delivery.state() == Delivery::State::kRefused) {
    return NotReceived(
        CommandState::kFailed,
        "nothing was done: the controller's queue is full, because no node acknowledges what is sent: check "
        "cable, termination and bit rate");
  }
  if (delivery.state() != Delivery::State::kNotConfirmed) return std::nullopt;
  return NotReceived(
      CommandState::kIndeterminate,
      Text("no node acknowledged the frame in %lld ms: it may still wait in the controller's queue and act "
           "later; drop it with: sudo ip link set %s down",
           InMilliseconds(Delivery::kConfirmWithin), settings.iface.c_str()));
}

// Return the final outcome if the link is lost: before the frame that changes something was sent, or after it may have been
// sent. `check`: how the user can see its effect.
inline Outcome LinkLostBefore() {
  return NotReceived(CommandState::kFailed, "nothing was done: the link was lost before it");
}

inline Outcome LinkLostAfter(const std::string& check) {
  return NotReceived(
      CommandState::kIndeterminate,
      "the link was lost after the request and before its effect could be seen: " + check + " when it is back");
}

// Sends one frame once, and waits for its effect. Before the frame it may read a position that shows where the shaft is,
// and verify the standstill again.
class OneFrameProcedure : public Procedure {
 public:
  [[nodiscard]] Need NextNeed(MonoNs now) const override {
    if (touched()) return delivered() && NeedsPosition(now) ? Need(Position{}) : Need(Nothing{});
    if (reads_before_ && !(read_ && AtRest(context_.output, now))) return Position{};
    return CommandFrame(command_, context_.settings.node, parameter_);
  }
  [[nodiscard]] MonoNs Due(MonoNs) const override {
    return delivered() || !touched() ? deadline_ : delivery_.due();
  }
  void OnStarted(const CanFrame& frame) override { delivery_.Start(frame); }
  std::optional<Outcome> On(const Event& event, const Interpreter::Evaluation& evaluation, MonoNs now) override {
    if (!touched()) return OnBefore(evaluation, now);
    acknowledged_ = acknowledged_ || evaluation.acknowledged == command_;
    if (!delivered()) {
      delivery_.On(event, now);
      if (auto failed = NotDelivered(delivery_, context_.settings)) return WithChanges(std::move(*failed));
      if (!delivered()) return std::nullopt;
      deadline_ = now + EffectTimeout();
      if (auto progress = Progress()) return progress;
    }
    return AfterDelivery(event, evaluation, now);
  }
  [[nodiscard]] Outcome OnLinkLost() const override {
    return touched() ? WithChanges(LinkLostAfter(Check())) : LinkLostBefore();
  }
  [[nodiscard]] bool touched() const override { return delivery_.state() != Delivery::State::kIdle; }

 protected:
  OneFrameProcedure(Command command, std::uint8_t parameter, const OperationContext& context)
      : context_(context), command_(command), parameter_(parameter) {}
  // Reads a position before the frame.
  OneFrameProcedure(Command command, std::uint8_t parameter, const OperationContext& context, MonoNs now)
      : context_(context),
        deadline_(now + Timeout(context.settings)),
        command_(command),
        parameter_(parameter),
        reads_before_(true) {}

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
  std::optional<Outcome> OnBefore(const Interpreter::Evaluation& evaluation, MonoNs now) {
    if (!reads_before_) return std::nullopt;
    if (evaluation.reading && !evaluation.reading->error) {
      if (!AtRest(context_.output, now)) return NotAtRest(context_.output.MotionAt(now));
      before_ = evaluation.reading->counts;
      if (Result<> here = CheckPosition(before_); !here) return RefusedOutcome(here.error());
      read_ = true;
      return std::nullopt;
    }
    if (now < deadline_) return std::nullopt;
    return Rejected(command_status_t::REASON_NO_REPLY, "no position came to begin with");
  }

  const Command command_;
  const std::uint8_t parameter_;
  Delivery delivery_;
  const bool reads_before_ = false;
  bool read_ = false;  // the position before the frame
};

// A procedure that changes nothing in the encoder.
class ReadProcedure : public Procedure {
 public:
  [[nodiscard]] Outcome OnLinkLost() const override {
    return NotReceived(CommandState::kFailed, "the link was lost before the reading was complete");
  }
  [[nodiscard]] bool reads_only() const override { return true; }
};

}  // namespace axlecast::saa_can
