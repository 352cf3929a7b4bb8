#include "drivers/saa_can/interpreter.h"

#include <algorithm>
#include <utility>

namespace axlecast::saa_can {
namespace {

// The manual's own log shows a period of 106.4 ms where 100 ms is set: three nominal ones are two and more real ones.
constexpr int kPeriodsToSilence = 3;
// Requests in a row that bring nothing, after which the encoder counts as gone.
constexpr int kGone = 2;

// They bring a position.
bool IsForPosition(Command command) { return command == Command::kRead || command == Command::kStart; }
// What the encoder may keep: counted as wear, since the manual does not say.
bool MayBeKept(Command command) { return !IsForPosition(command); }
// They move the position without motion.
bool MovesDatum(Command command) { return command == Command::kZero || command == Command::kDirection; }

}  // namespace

Interpreter::Interpreter(const SaaCanSettings& settings, MonoNs late, DeviceOutput& output)
    : settings_(settings),
      late_(late),
      output_(output),
      period_(settings.period),
      cadence_(period_ + settings.latency, kPeriodsToSilence) {}

void Interpreter::OnLinkUp(MonoNs now) {
  now_ = now;
  answering_ = false;
  silent_in_a_row_ = 0;
  asked_.reset();
  quiet_until_ = now + late_;
  pace_ = {};
  unconfirmed_ = false;
  windows_.fill({});
  if (settings_.mode == Mode::kCyclic) cadence_.Arrived(now);
}

void Interpreter::OnLinkDown(MonoNs now) {
  // What was in the controller's queue is gone with the interface, or was on the bus.
  if (jumping_ && effect_from_ == kNever) effect_from_ = now + settings_.zero_settle;
  answering_ = false;
  asked_.reset();
  unconfirmed_ = false;
}

MonoNs Interpreter::due() const {
  if (settings_.mode == Mode::kCyclic) return cadence_.due();
  if (!asked_) return kNever;
  return asked_->at + (asked_->missed ? late_ : settings_.timeout);
}

Interpreter::Heard Interpreter::Take(const Event& event) {
  now_ = std::max(now_, EndOf(event));
  Heard heard;
  switch (event.kind) {
    case Event::Kind::kFrame:
      if (event.id == DataId(settings_.node)) {
        heard = OnData(event);
      } else if (event.id == RequestId(settings_.node)) {
        if (const auto request = ParseRequest(event.bytes)) OnCommand(*request, now_);
      }
      break;
    case Event::Kind::kSent:
      if (event.id == RequestId(settings_.node)) OnOwnSent(event);
      if (event.id == kConfigureId && SetsParameter(event.bytes)) output_.OnNonVolatileWrite();
      break;
    case Event::Kind::kConfirmed:
      if (event.id == RequestId(settings_.node)) OnConfirmed(event);
      break;
    case Event::Kind::kNotSent:
      if (event.id == RequestId(settings_.node)) output_.OnError(ErrorKind::kIo, event.sent);
      break;
    default:
      break;
  }
  MissWhatIsDue(event);
  return heard;
}

void Interpreter::OnOwnSent(const Event& event) {
  const std::optional<Request> request = ParseRequest(event.bytes);
  if (!request) return;
  unconfirmed_ = true;
  const bool asks = IsForPosition(request->command);
  if (asks && settings_.mode == Mode::kSingle) {
    pace_.Asked(now_);
    asked_ = {.sent = event.received.first, .at = now_};
  }
  if (!asks) OnCommand(*request, kNever);
}

void Interpreter::OnConfirmed(const Event& event) {
  unconfirmed_ = false;
  const std::optional<Request> request = ParseRequest(event.bytes);
  if (!request) return;
  if (asked_ && IsForPosition(request->command)) asked_->at = now_;
  for (std::size_t i = 0; i < windows_.size(); ++i) {
    if (kAcknowledged.at(i) == request->command) windows_.at(i).until = now_ + settings_.reply_window;
  }
  if (MovesDatum(request->command) && jumping_) effect_from_ = now_ + settings_.zero_settle;
}

// `on_bus_at`: kNever while it is only in the queue.
void Interpreter::OnCommand(const Request& request, MonoNs on_bus_at) {
  const auto after = [&](MonoNs time) { return on_bus_at == kNever ? kNever : on_bus_at + time; };
  for (std::size_t i = 0; i < windows_.size(); ++i) {
    if (kAcknowledged.at(i) == request.command) windows_.at(i) = {.until = after(settings_.reply_window)};
  }
  if (request.command == Command::kPeriod) {
    per_second_ordered_ = request.parameter == settings_.stop_byte ? std::uint8_t{0} : request.parameter;
  }
  if (MayBeKept(request.command)) output_.OnNonVolatileWrite();
  if (!MovesDatum(request.command)) return;
  BeginJump(after(settings_.zero_settle));
}

Interpreter::Heard Interpreter::OnData(const Event& event) {
  answering_ = true;
  silent_in_a_row_ = 0;
  if (settings_.mode == Mode::kCyclic) cadence_.Arrived(now_);
  if (const auto command = Withhold(event)) return {.reading = {}, .acknowledged = command, .frame = true};
  return OnPosition(event);
}

// The request that a position answers, if one was asked for.
std::optional<Interpreter::Asked> Interpreter::TakeAnswered() {
  if (!asked_) {
    pace_.CameUnasked(now_);
    return std::nullopt;
  }
  pace_.Answered(now_);
  return std::exchange(asked_, std::nullopt);
}

std::optional<Command> Interpreter::Withhold(const Event& event) {
  for (std::size_t i = 0; i < windows_.size(); ++i) {
    Window& window = windows_.at(i);
    if (window.until <= event.received.first) continue;
    if (!MayAcknowledge(event.bytes, kAcknowledged.at(i), settings_.format.bits)) continue;
    if (std::exchange(window.answered, true)) {
      output_.OnError(ErrorKind::kBusy, event.received);
    } else {
      OnAcknowledged(kAcknowledged.at(i));
    }
    return kAcknowledged.at(i);
  }
  return std::nullopt;
}

Interpreter::Heard Interpreter::OnPosition(const Event& event) {
  const std::optional<Asked> asked = TakeAnswered();
  const Position position = ParsePosition(event.bytes, settings_.format);
  Reading reading{.error = {}, .counts = position.counts, .at = event.received};
  if (position.error != PositionError::kNone) {
    reading.error = position.error == PositionError::kShort ? ErrorKind::kShort : ErrorKind::kRange;
    output_.OnError(*reading.error, event.received);
    return {.reading = reading, .acknowledged = {}, .frame = true};
  }
  reading.at = SampledAt(event, asked);
  if (jumping_ && reading.at.first >= effect_from_) EndJump();
  output_.OnSample({.at = reading.at, .counts = reading.counts});
  return {.reading = reading, .acknowledged = {}, .frame = true};
}

// The kernel stamps a frame when its last bit but one was on the bus, or after that. The position was sampled before
// its first bit: later than that by no more than `latency`, within which the frame also waits for a busy bus. An adapter
// that holds an answer back stamps it late: it was sampled after its request all the same, but for `latency`.
Interval Interpreter::SampledAt(const Event& event, const std::optional<Asked>& asked) const {
  const std::size_t size = event.bytes.size();
  const MonoNs earliest = event.received.first - settings_.wire.Longest(size) - settings_.latency;
  Interval at{earliest, std::max(earliest, event.received.last - settings_.wire.Shortest(size))};
  if (settings_.mode == Mode::kCyclic) return at;
  if (!asked) {
    at.first -= std::max<MonoNs>(0, late_ - settings_.latency);
  } else if (at.first > asked->sent) {
    at.first = asked->sent - settings_.latency;
  }
  return at;
}

void Interpreter::MissWhatIsDue(const Event& event) {
  if (settings_.mode == Mode::kCyclic) {
    if (!cadence_.FellSilent(now_)) return;
    ++silent_in_a_row_;
    answering_ = false;
    output_.OnError(ErrorKind::kSilent, event.received);
    return;
  }
  if (!asked_) return;
  if (!asked_->missed && now_ >= asked_->at + settings_.timeout) {
    asked_->missed = true;
    if (++silent_in_a_row_ >= kGone) answering_ = false;
    output_.OnError(ErrorKind::kTimeout, event.received);
  }
  // Until then the answer may come late, and could be taken for that to another request.
  if (now_ >= asked_->at + late_) asked_.reset();
}

void Interpreter::OnAcknowledged(Command command) {
  if (command != Command::kPeriod || per_second_ordered_ == 0 || settings_.mode != Mode::kCyclic) return;
  period_ = kSecond / per_second_ordered_;
  cadence_ = PeriodMonitor(period_ + settings_.latency, kPeriodsToSilence);
  cadence_.Arrived(now_);
}

void Interpreter::BeginJump(MonoNs effect_from) {
  effect_from_ = effect_from;
  if (!std::exchange(jumping_, true)) output_.OnDatumChanging(true);
}

void Interpreter::EndJump() {
  jumping_ = false;
  output_.OnDatumChanging(false);
  output_.OnJump();
}

}  // namespace axlecast::saa_can
