#include <algorithm>
#include <memory>
#include <optional>
#include <utility>
#include <variant>

#include "core/device/operation.h"
#include "drivers/kit/command_runner.h"
#include "drivers/kit/stream.h"
#include "drivers/saa_serial/family.h"
#include "drivers/saa_serial/operations.h"
#include "drivers/saa_serial/stream_parser.h"

namespace axlecast::saa_serial {

namespace {

// Requests in a row that bring not a single byte, after which the encoder counts as gone.
constexpr int kGone = 2;
// Periods without a byte, after which a stream counts as silent.
constexpr int kPeriodsToSilence = 3;

MonoNs CharacterTime(const BusConfig& bus) { return bus.simulate ? 0 : bus.link.line.ShortestCharacter(); }

bool IsFirst(const BusConfig& bus, const SaaSettings& settings) {
  return bus.devices.empty() || bus.devices.front().settings.get() == &settings;
}

using Need = Procedure::Need;

// Evaluates what the encoder sends and reports samples, errors by kind, and jumps of the position by clearing to zero.
// The reports depend only on the events, not on the reason for a request: a recorded sequence of events gives the same
// reports again.
class Interpreter {
 public:
  Interpreter(const BusConfig& bus, const SaaSettings& settings, DeviceOutput& output)
      : mode_(OwnBus(bus).mode),
        settings_(settings),
        guards_line_(IsFirst(bus, settings)),
        character_(CharacterTime(bus)),
        times_{character_,          bus.link.line.WireTime(1), OwnBus(bus).refresh,
               settings.processing, settings.latency,          bus.late},
        output_(output),
        parser_(settings.format.bits),
        stalled_(times_),
        cadence_(times_.period + settings.latency, kPeriodsToSilence) {}

  void OnLinkUp(MonoNs now) {
    answering_ = false;
    silent_in_a_row_ = 0;
    emptied_ = now;
    parser_.Restart();
    stalled_.Restart(now);
    polled_.reset();
    if (mode_ == Mode::kTiming) {
      cadence_.Arrived(now);
    } else if (guards_line_) {
      quiet_needed_ = settings_.silence;
    }
  }
  // `zeroing`: the request to clear to zero was under way.
  void OnLinkDown(bool zeroing, MonoNs now) {
    if (zeroing) BeginJump(now);
    answering_ = false;
    quiet_needed_ = 0;
  }
  // Any other event. Afterwards Next, until it has nothing left: it reports each reading to the output.
  void Take(const Event& event) {
    switch (event.kind) {
      case Event::Kind::kReply:
      case Event::Kind::kTimeout:
        if (settings_.zero_command && ParseRequest(event.request) == settings_.zero_command) {
          quiet_needed_ = event.bytes.empty() ? 0 : settings_.silence;
          BeginJump(event.End());
        } else {
          OnPolled(event);
        }
        break;
      case Event::Kind::kUnsolicited:
      case Event::Kind::kUnexpectedBytes:
        if (mode_ == Mode::kTiming) {
          OnStream(event);
        } else {
          OnStray(event);
        }
        break;
      case Event::Kind::kPulsed:  // only CLR is pulsed without an exchange
        BeginJump(event.End());
        break;
      case Event::Kind::kSilent:
        quiet_needed_ = 0;
        break;
      default:
        break;
    }
    if (mode_ == Mode::kTiming && cadence_.FellSilent(event.End())) {
      answering_ = false;
      output_.OnError(ErrorKind::kSilent, event.received);
    }
  }
  [[nodiscard]] std::optional<Reading> Next() {
    std::optional<Reading> reading = mode_ == Mode::kTiming ? NextOfStream() : std::exchange(polled_, std::nullopt);
    if (reading) Update(*reading);
    return reading;
  }

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
  void OnStream(const Event& event) {
    const MonoNs now = event.received.last;
    parser_.Append(event.bytes, {std::min(emptied_, now), now});
    stalled_.Arrived(now);
    // A read that was filled to the brim may have left bytes on the line.
    all_read_ = event.bytes.size() < kMaxFrame;
    if (all_read_) emptied_ = now;
    cadence_.Arrived(now);
  }
  void OnPolled(const Event& event) {
    const PolledReading polled = ReadReply(event, settings_.format, character_);
    polled_ = polled.reading;
    if (polled.stray > 0) output_.OnError(ErrorKind::kUnexpectedBytes, event.received);
    quiet_needed_ = 0;
    if (polled.reading.error) quiet_needed_ = settings_.silence;
    const bool silent = polled.reading.error == ErrorKind::kTimeout;
    silent_in_a_row_ = silent ? silent_in_a_row_ + 1 : 0;
    if (silent_in_a_row_ >= kGone) answering_ = false;
  }
  void OnStray(const Event& event) {
    output_.OnError(ErrorKind::kUnexpectedBytes, event.received);
    if (guards_line_) quiet_needed_ = std::max(quiet_needed_, settings_.silence);
  }
  void BeginJump(MonoNs now) {
    effect_from_ = now + settings_.zero_settle;
    output_.OnNonVolatileWrite();
    if (!std::exchange(jumping_, true)) output_.OnDatumChanging(true);
  }
  void Update(const Reading& reading) {
    if (reading.error) return output_.OnError(*reading.error, reading.at);
    answering_ = true;
    if (jumping_ && reading.at.first >= effect_from_) {
      jumping_ = false;
      output_.OnDatumChanging(false);
      output_.OnJump();
    }
    output_.OnSample({.at = reading.at, .counts = reading.counts});
  }
  [[nodiscard]] std::optional<Reading> NextOfStream() {
    std::optional<StreamParser::Found> found = parser_.Next();
    if (!found) return std::nullopt;
    if (!all_read_) found->behind.reset();
    if (found->error) return Reading{.error = found->error, .counts = 0, .at = found->first};
    const Interval at = stalled_.Widened(StreamedInstant(*found, ReplySize(settings_.format.bits), times_));
    return Reading{.error = {}, .counts = found->counts, .at = at};
  }

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
  SaaDevice(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output)
      : CommandDevice(device.settings, Operations(), output),
        owned_bus_(bus.family_bus),
        bus_(OwnBus(bus)),
        settings_(Own(device)),
        line_(bus.link.line),
        interpreter_(bus, settings_, output) {}

  [[nodiscard]] Step Next(const BusSlot& slot) const override {
    if (!link_up_) return {.action = Idle{kNever}, .priority = Priority::kLive};
    if (interpreter_.quiet_needed() > 0) {
      return {.action = WaitForIdleLine{interpreter_.quiet_needed()}, .priority = Priority::kLive};
    }
    const Procedure* procedure = runner_.Runnable(slot.now);
    const Need need = procedure != nullptr ? procedure->Next(slot.now) : Need::kNothing;
    if (need == Need::kZero && !slot.reserved) return ZeroStep();
    return bus_.mode == Mode::kTiming ? Stream(slot) : Poll(slot, need);
  }
  void OnStarted(const Step& step, MonoNs now) override {
    runner_.ExpireIfLate(now);
    live_slot_ = step.priority == Priority::kCommand;
    const auto* exchange = std::get_if<Exchange>(&step.action);
    zeroing_ =
        runner_.busy() && live_slot_ &&
        (std::holds_alternative<Pulse>(step.action) || (exchange != nullptr && exchange->reply_length == nullptr));
    if (zeroing_) runner_.procedure().OnZeroStarted();
  }
  void On(const Event& event) override {
    const MonoNs now = event.End();
    switch (event.kind) {
      case Event::Kind::kLinkUp:
        link_up_ = true;
        interpreter_.OnLinkUp(now);
        break;
      case Event::Kind::kLinkDown:
        OnLinkDown(now);
        break;
      default:
        interpreter_.Take(event);
        AdvanceProcedure(event);
        break;
    }
  }
  void Begin(const DriverCommand& command, MonoNs now) override {
    if (runner_.Begin(command, link_up_, now)) live_slot_ = false;
  }

 private:
  [[nodiscard]] Result<std::unique_ptr<Procedure>> MakeProcedure(const DriverCommand& command,
                                                                 MonoNs now) const override {
    return saa_serial::MakeProcedure(command, bus_, settings_, output_, now);
  }
  [[nodiscard]] Result<> CheckState(const DriverCommand&, MonoNs) const override {
    if (interpreter_.answering()) return {};
    return DeviceOffline("nothing is received from the encoder: check its power, its cable and the mode");
  }
  [[nodiscard]] Step Stream(const BusSlot& slot) const {
    MonoNs until = interpreter_.silent_at();
    if (runner_.busy()) until = std::min({until, runner_.procedure().Due(slot.now), runner_.ExpiresAt()});
    return {.action = Listen{std::max(until, slot.now)}, .priority = Priority::kLive};
  }
  [[nodiscard]] Step Poll(const BusSlot& slot, Need need) const {
    const bool live = slot.poll_due && (need != Need::kReading || live_slot_ || slot.reserved);
    if (live) return {.action = AskPosition(), .priority = Priority::kLive};
    if (need == Need::kReading) return {.action = AskPosition(), .priority = Priority::kCommand};
    const MonoNs until = runner_.busy() ? runner_.procedure().Due(slot.now) : kNever;
    return {.action = Idle{until}, .priority = Priority::kLive};
  }
  [[nodiscard]] Exchange AskPosition() const {
    Exchange exchange;
    exchange.reply_length = LengthRule(settings_.format.bits);
    exchange.reply_begin = &BeginOfReply;
    exchange.shape = ShapeOf(settings_.format);
    exchange.timeout = settings_.timeout + line_.WireTime(kRequestSize + ReplySize(settings_.format.bits));
    if (bus_.mode == Mode::kHandshake) {
      exchange.pulse = Pulse{bus_.clk->index, bus_.clk->low};
    } else {
      exchange.request = Request(settings_.format.address);
    }
    return exchange;
  }
  [[nodiscard]] Step ZeroStep() const {
    if (bus_.mode != Mode::kBus) {
      return {.action = Pulse{bus_.clr->index, bus_.clr->low}, .priority = Priority::kCommand};
    }
    return {.action = Exchange{.request = Request(*settings_.zero_command),
                               .reply_length = nullptr,
                               .timeout = line_.WireTime(kRequestSize)},
            .priority = Priority::kCommand};
  }
  void OnLinkDown(MonoNs now) {
    link_up_ = false;
    interpreter_.OnLinkDown(std::exchange(zeroing_, false), now);
    runner_.OnLinkLost();
  }
  void AdvanceProcedure(const Event& event) {
    const MonoNs now = event.End();
    const bool exchange = event.kind == Event::Kind::kTimeout || event.kind == Event::Kind::kReply;
    const bool zeroed = zeroing_ && (exchange || event.kind == Event::Kind::kPulsed);
    if (zeroed) {
      zeroing_ = false;
      runner_.Report(runner_.procedure().OnZeroed(interpreter_.effect_from()));
    }
    while (const std::optional<Reading> reading = interpreter_.Next()) {
      if (Procedure* procedure = runner_.Runnable(now)) runner_.Report(procedure->OnReading(*reading, now));
    }
    if (runner_.ExpireIfLate(now) || !runner_.busy()) return;
    runner_.Report(runner_.procedure().OnTime(now));
  }

  std::shared_ptr<const FamilyBus> owned_bus_;  // keeps bus_ alive
  const SaaBus& bus_;
  const SaaSettings& settings_;
  const LineFormat line_;
  Interpreter interpreter_;
  bool zeroing_ = false;    // the request to clear to zero is under way
  bool live_slot_ = false;  // the last slot was the procedure's: a live reading that is due goes first
};

}  // namespace

std::unique_ptr<Device> MakeDevice(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output,
                                   SecretSource&) {
  return std::make_unique<SaaDevice>(bus, device, output);
}

}  // namespace axlecast::saa_serial
