#pragma once

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
    kRefused,       // its queue is full: the frame is nowhere
    kQueued,        // in the queue
    kNotConfirmed,  // for too long. It goes out as soon as any node acknowledges it, whenever that is
    kOnBus,         // acknowledged by a node
  };

  // Waiting for a busy bus takes some frames' time, below 10 ms: what takes longer has no node to acknowledge it.
  static constexpr MonoNs kConfirmWithin = 500 * kMillisecond;

  void Start(const CanFrame& frame);
  // Any event; its end.
  void On(const Event& event, MonoNs now);

  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] MonoNs on_bus_at() const { return at_; }
  // When to ask again.
  [[nodiscard]] MonoNs due() const { return state_ == State::kQueued ? at_ + kConfirmWithin : kNever; }

 private:
  CanFrame frame_;
  State state_ = State::kIdle;
  MonoNs at_ = 0;  // of the state
};

// What a procedure may know of the device. Outlives the procedure.
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
  struct Position {};  // as soon as the encoder sends one, or is asked for one
  using Want = std::variant<Nothing, Position, CanFrame>;
  [[nodiscard]] virtual Want Wants(MonoNs now) const = 0;
  // It wants to be asked again by then.
  [[nodiscard]] virtual MonoNs Due(MonoNs now) const = 0;

  // The frame that it wanted is about to be handed to the controller.
  virtual void OnStarted([[maybe_unused]] const CanFrame& frame) {}
  // An outcome: progress, or the final one.
  virtual std::optional<Outcome> On(const Event& event, const Interpreter::Heard& heard, MonoNs now) = 0;

  // Nothing else may be transmitted meanwhile.
  [[nodiscard]] virtual bool alone() const { return false; }
  // The encoder may run at another bit rate: nothing must be transmitted until the link comes up again.
  [[nodiscard]] virtual bool silences() const { return false; }
};

// Words and judgements that the procedures share.

// For a position: several periods of a slow encoder, or several requests in vain.
[[nodiscard]] MonoNs Patience(const SaaCanSettings& settings);

// How the order ends when its frame did not come onto the bus; nothing while it may, or when it did.
[[nodiscard]] std::optional<Outcome> NotDelivered(const Delivery& delivery, const SaaCanSettings& settings);

// The link is gone. `sent`: the frame that changes something may have gone out.
[[nodiscard]] Outcome LinkLost(bool sent, const char* look);

// The outcome of a reading that brought nothing.
[[nodiscard]] Outcome NothingRead(std::string text);

// "14.0625 deg (counts 640)"
[[nodiscard]] std::string PositionText(std::int64_t counts, int bits);

// The shaft stands where a position has the bytes of the reply to this command.
[[nodiscard]] bool LooksLikeReply(std::int64_t counts, Command command, const SaaCanSettings& settings);

// Whether a position is what an encoder that was just cleared to zero may read.
[[nodiscard]] bool IsNearZero(std::int64_t counts, const SaaCanSettings& settings);

[[nodiscard]] bool AtRest(const DeviceOutput& output, MonoNs now);

// How root brings the interface up at this rate, in one line.
[[nodiscard]] std::string IpLinkLine(const std::string& iface, std::int64_t bitrate);

// The period of frames that an encoder sends by itself, from their arrivals.
class PeriodMeter {
 public:
  static constexpr int kPeriods = 5;

  void Add(MonoNs at) {
    if (frames_++ == 0) first_ = at;
    last_ = at;
  }
  [[nodiscard]] bool done() const { return frames_ > kPeriods; }
  // 0 before the second frame.
  [[nodiscard]] MonoNs Mean() const { return frames_ < 2 ? 0 : (last_ - first_) / (frames_ - 1); }
  // Within a quarter of the nominal one: the manual's own log is 6.4 % off.
  [[nodiscard]] bool Fits(MonoNs nominal) const {
    const MonoNs off = Mean() > nominal ? Mean() - nominal : nominal - Mean();
    return off * 4 <= nominal;
  }
  // For a meter to be done, at most.
  [[nodiscard]] static MonoNs Patience(MonoNs nominal) { return 2 * kSecond + 2 * kPeriods * nominal; }

 private:
  int frames_ = 0;
  MonoNs first_ = 0;
  MonoNs last_ = 0;
};

// Clears the encoder to zero (20 NN, SAA manual 5.4.1 (3) ⑥): a position that shows where the shaft was, standstill
// measured once more, the frame once, and positions that show the effect. The reply alone proves nothing: it looks
// like a position.
class Zero final : public Procedure {
 public:
  Zero(const OperationContext& context, MonoNs now);

  [[nodiscard]] Want Wants(MonoNs now) const override;
  [[nodiscard]] MonoNs Due(MonoNs now) const override;
  void OnStarted(const CanFrame& frame) override;
  std::optional<Outcome> On(const Event& event, const Interpreter::Heard& heard, MonoNs now) override;
  [[nodiscard]] Outcome OnLinkLost() const override;
  [[nodiscard]] bool touched() const override { return stage_ >= Stage::kDeliver; }

 private:
  enum class Stage : std::uint8_t { kReadBefore, kSend, kDeliver, kVerify };

  std::optional<Outcome> OnBefore(const Interpreter::Heard& heard, MonoNs now);
  std::optional<Outcome> OnDelivery(const Event& event, MonoNs now);
  std::optional<Outcome> OnVerify(const Interpreter::Heard& heard, MonoNs now);
  [[nodiscard]] bool SameBefore() const;
  [[nodiscard]] Outcome Judge(std::int64_t counts) const;
  [[nodiscard]] Outcome WithCounts(Outcome outcome, const std::string& after) const;

  const OperationContext context_;
  Stage stage_ = Stage::kReadBefore;
  MonoNs deadline_;
  Delivery delivery_;
  std::int64_t before_ = 0;
  bool acknowledged_ = false;
  int looks_ = 0;
};

// Sets the counting direction (22 NN, SAA manual 5.4.1 (3) ④⑤) with the byte that the configuration supplies. The
// reply says that it was accepted; only a motion shows it. It is refused where a position of the shaft at rest could
// pass for the reply.
class SetDirection final : public Procedure {
 public:
  SetDirection(std::uint8_t parameter, const OperationContext& context, MonoNs now);

  [[nodiscard]] Want Wants(MonoNs now) const override;
  [[nodiscard]] MonoNs Due(MonoNs) const override;
  void OnStarted(const CanFrame& frame) override;
  std::optional<Outcome> On(const Event& event, const Interpreter::Heard& heard, MonoNs now) override;
  [[nodiscard]] Outcome OnLinkLost() const override;
  [[nodiscard]] bool touched() const override { return delivery_.state() != Delivery::State::kIdle; }

 private:
  std::optional<Outcome> OnBefore(const Interpreter::Heard& heard, MonoNs now);
  [[nodiscard]] Outcome WithCounts(Outcome outcome, const std::string& after) const;

  const std::uint8_t parameter_;
  const OperationContext context_;
  MonoNs deadline_;
  bool read_ = false;
  std::int64_t before_ = 0;
  Delivery delivery_;
};

// Returns an error if the direction cannot be set at this position: it has the bytes of the reply.
[[nodiscard]] Result<> CheckDirectionAt(std::int64_t counts, const SaaCanSettings& settings);

// Sets how often the encoder sends by itself (31 NN TT, ⑦), and measures it.
class SetPeriod final : public Procedure {
 public:
  SetPeriod(std::uint8_t per_second, const OperationContext& context);

  [[nodiscard]] Want Wants(MonoNs now) const override;
  [[nodiscard]] MonoNs Due(MonoNs) const override;
  void OnStarted(const CanFrame& frame) override { delivery_.Start(frame); }
  std::optional<Outcome> On(const Event& event, const Interpreter::Heard& heard, MonoNs now) override;
  [[nodiscard]] Outcome OnLinkLost() const override { return LinkLostText(); }
  [[nodiscard]] bool touched() const override { return delivery_.state() != Delivery::State::kIdle; }

 private:
  [[nodiscard]] Outcome Judge() const;
  [[nodiscard]] Outcome LinkLostText() const;
  [[nodiscard]] MonoNs period() const { return kSecond / per_second_; }

  const std::uint8_t per_second_;
  const OperationContext context_;
  Delivery delivery_;
  bool acknowledged_ = false;
  MonoNs deadline_ = kNever;
  PeriodMeter meter_;
};

// Stops an encoder that sends by itself though it is to be asked (31 NN TT, ⑧) with the byte that the configuration
// supplies; then nothing is asked for a while, and nothing must come.
class StopCyclic final : public Procedure {
 public:
  StopCyclic(std::uint8_t parameter, const OperationContext& context) : parameter_(parameter), context_(context) {}

  [[nodiscard]] Want Wants(MonoNs now) const override;
  [[nodiscard]] MonoNs Due(MonoNs) const override;
  void OnStarted(const CanFrame& frame) override { delivery_.Start(frame); }
  std::optional<Outcome> On(const Event& event, const Interpreter::Heard& heard, MonoNs now) override;
  [[nodiscard]] Outcome OnLinkLost() const override;
  [[nodiscard]] bool touched() const override { return delivery_.state() != Delivery::State::kIdle; }
  [[nodiscard]] bool alone() const override { return touched(); }

  // Longer than the longest period, of one position a second.
  static constexpr MonoNs kQuiet = 1'500 * kMillisecond;
  // A position that was asked for, or was on its way, may still come so long.
  static constexpr MonoNs kSettle = 100 * kMillisecond;

 private:
  const std::uint8_t parameter_;
  const OperationContext context_;
  Delivery delivery_;
  bool acknowledged_ = false;
};

// One position, shown; also whether it looks as after the operation that was ordered before.
class ReadPosition final : public Procedure {
 public:
  enum class After : std::uint8_t { kNothing, kZero, kDirection, kBitrate };
  ReadPosition(After after, const OperationContext& context, MonoNs now);

  [[nodiscard]] Want Wants(MonoNs) const override { return Position{}; }
  [[nodiscard]] MonoNs Due(MonoNs) const override { return deadline_; }
  std::optional<Outcome> On(const Event& event, const Interpreter::Heard& heard, MonoNs now) override;
  [[nodiscard]] Outcome OnLinkLost() const override;

 private:
  [[nodiscard]] const char* Finding(std::int64_t counts, MonoNs now) const;

  const After after_;
  const OperationContext context_;
  const MonoNs deadline_;
};

// Measures how often the encoder sends by itself, to see whether set_period took effect.
class LookForPeriod final : public Procedure {
 public:
  LookForPeriod(MonoNs period, const OperationContext& context, MonoNs now);

  [[nodiscard]] Want Wants(MonoNs) const override { return Nothing{}; }
  [[nodiscard]] MonoNs Due(MonoNs) const override { return deadline_; }
  std::optional<Outcome> On(const Event& event, const Interpreter::Heard& heard, MonoNs now) override;
  [[nodiscard]] Outcome OnLinkLost() const override;

 private:
  const MonoNs period_;
  const MonoNs deadline_;
  PeriodMeter meter_;
};

}  // namespace axlecast::saa_can
