#include "drivers/saa_can/interpreter.h"

#include <algorithm>
#include <utility>

namespace axlecast::saa_can {
namespace {

// The manual's own log shows a period of 106.4 ms where 100 ms is set: three nominal periods are more than two real ones.
constexpr int kPeriodsToSilence = 3;
// Consecutive requests without a position, after which the encoder counts as gone.
constexpr int kGone = 2;

// These commands request a position. All others may change something that the encoder stores: they count as wear, because
// the manual does not exclude it.
bool IsForPosition(Command command) { return command == Command::kRead || command == Command::kStart; }
// These commands change the position without motion.
bool MovesDatum(Command command) { return command == Command::kZero || command == Command::kDirection; }

}  // namespace

Interpreter::Interpreter(const SaaCanSettings& settings, MonoNs late, DeviceOutput& output)
    : settings_(settings),
      late_(late),
      output_(output),
      period_(settings.period),
      monitor_(period_ + settings.latency, kPeriodsToSilence) {}

void Interpreter::OnLinkUp(MonoNs now) {
  now_ = now;
  answering_ = false;
  silent_in_a_row_ = 0;
  request_.reset();
  quiet_until_ = now + late_;
  pace_ = {};
  unconfirmed_ = false;
  windows_.fill({});
  if (settings_.mode == Mode::kCyclic) monitor_.Arrived(now);
}

void Interpreter::OnLinkDown(MonoNs now) {
  // What was in the controller's queue is gone with the interface, or was on the bus.
  if (jumping_ && effect_from_ == kNever) effect_from_ = now + settings_.zero_settle;
  answering_ = false;
  request_.reset();
  unconfirmed_ = false;
}

MonoNs Interpreter::due() const {
  if (settings_.mode == Mode::kCyclic) return monitor_.due();
  if (!request_) return kNever;
  return request_->at + (request_->missed ? late_ : settings_.timeout);
}

Interpreter::Evaluation Interpreter::Evaluate(const Event& event) {
  now_ = std::max(now_, EndOf(event));
  Evaluation evaluation;
  switch (event.kind) {
    case Event::Kind::kFrame:
      if (event.id == DataId(settings_.node)) {
        evaluation = OnData(event);
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
  ReportOverdue(event);
  return evaluation;
}

void Interpreter::OnOwnSent(const Event& event) {
  const std::optional<Request> request = ParseRequest(event.bytes);
  if (!request) return;
  unconfirmed_ = true;
  if (!IsForPosition(request->command)) return OnCommand(*request, kNever);
  if (settings_.mode != Mode::kSingle) return;
  pace_.OnRequest(now_);
  request_ = {.sent = event.received.first, .at = now_};
}

Interpreter::Window* Interpreter::WindowOf(Command command) {
  const auto* const found = std::find(kAcknowledged.begin(), kAcknowledged.end(), command);
  if (found == kAcknowledged.end()) return nullptr;
  return &windows_.at(static_cast<std::size_t>(found - kAcknowledged.begin()));
}

void Interpreter::OnConfirmed(const Event& event) {
  unconfirmed_ = false;
  const std::optional<Request> request = ParseRequest(event.bytes);
  if (!request) return;
  if (request_ && IsForPosition(request->command)) request_->at = now_;
  if (Window* window = WindowOf(request->command)) window->until = now_ + settings_.reply_window;
  if (MovesDatum(request->command) && jumping_) effect_from_ = now_ + settings_.zero_settle;
}

void Interpreter::OnCommand(const Request& request, MonoNs on_bus_at) {
  const auto after = [&](MonoNs time) { return on_bus_at == kNever ? kNever : on_bus_at + time; };
  if (Window* window = WindowOf(request.command)) *window = {.until = after(settings_.reply_window)};
  if (request.command == Command::kPeriod) {
    per_second_sent_ = request.parameter == settings_.stop_byte ? std::uint8_t{0} : request.parameter;
  }
  if (!IsForPosition(request.command)) output_.OnNonVolatileWrite();
  if (!MovesDatum(request.command)) return;
  effect_from_ = after(settings_.zero_settle);
  if (!std::exchange(jumping_, true)) output_.OnDatumChanging(true);
}

// The request that a position answers, if one was sent.
std::optional<Interpreter::PositionRequest> Interpreter::TakeAnswered() {
  request_ ? pace_.OnAnswer(now_) : pace_.OnUnrequested(now_);
  return std::exchange(request_, std::nullopt);
}

std::optional<Command> Interpreter::Withhold(const Event& event) {
  for (const Command command : kAcknowledged) {
    Window& window = *WindowOf(command);
    if (window.until <= event.received.first) continue;
    if (!MayAcknowledge(event.bytes, command, settings_.format.bits)) continue;
    if (std::exchange(window.answered, true)) {
      output_.OnError(ErrorKind::kBusy, event.received);
    } else {
      OnAcknowledged(command);
    }
    return command;
  }
  return std::nullopt;
}

Interpreter::Evaluation Interpreter::OnData(const Event& event) {
  answering_ = true;
  silent_in_a_row_ = 0;
  if (settings_.mode == Mode::kCyclic) monitor_.Arrived(now_);
  if (const auto command = Withhold(event)) return {.reading = {}, .acknowledged = command};
  const std::optional<PositionRequest> request = TakeAnswered();
  const Position position = ParsePosition(event.bytes, settings_.format);
  Reading reading{.error = {}, .counts = position.counts, .at = event.received};
  if (position.error != PositionError::kNone) {
    reading.error = position.error == PositionError::kShort ? ErrorKind::kShort : ErrorKind::kRange;
    output_.OnError(*reading.error, event.received);
    return {.reading = reading, .acknowledged = {}};
  }
  reading.at = SampledAt(event, request);
  if (jumping_ && reading.at.first >= effect_from_) EndJump();
  output_.OnSample({.at = reading.at, .counts = reading.counts});
  return {.reading = reading, .acknowledged = {}};
}

// The kernel sets the timestamp of a frame when its last bit but one was on the bus, or later. The position was sampled at
// most `latency` before the first bit of the frame; in this time, the frame also waits for a busy bus. An adapter that
// delays an answer sets its timestamp too late. Even then, the position was sampled at most `latency` before its request.
Interval Interpreter::SampledAt(const Event& event, const std::optional<PositionRequest>& request) const {
  const std::size_t size = event.bytes.size();
  const MonoNs earliest = event.received.first - settings_.wire.Longest(size) - settings_.latency;
  Interval at{earliest, std::max(earliest, event.received.last - settings_.wire.Shortest(size))};
  if (settings_.mode == Mode::kCyclic) return at;
  if (!request) {
    at.first -= std::max<MonoNs>(0, late_ - settings_.latency);
  } else if (at.first > request->sent) {
    at.first = request->sent - settings_.latency;
  }
  return at;
}

void Interpreter::ReportOverdue(const Event& event) {
  if (settings_.mode == Mode::kCyclic) {
    if (!monitor_.FellSilent(now_)) return;
    ++silent_in_a_row_;
    answering_ = false;
    output_.OnError(ErrorKind::kSilent, event.received);
    return;
  }
  if (!request_) return;
  if (!request_->missed && now_ >= request_->at + settings_.timeout) {
    request_->missed = true;
    if (++silent_in_a_row_ >= kGone) answering_ = false;
    output_.OnError(ErrorKind::kTimeout, event.received);
  }
  // Until then the answer may come late, and could be taken for that to another request.
  if (now_ >= request_->at + late_) request_.reset();
}

void Interpreter::OnAcknowledged(Command command) {
  if (command != Command::kPeriod || per_second_sent_ == 0 || settings_.mode != Mode::kCyclic) return;
  period_ = kSecond / per_second_sent_;
  monitor_ = PeriodMonitor(period_ + settings_.latency, kPeriodsToSilence);
  monitor_.Arrived(now_);
}

void Interpreter::EndJump() {
  jumping_ = false;
  output_.OnDatumChanging(false);
  output_.OnJump();
}

}  // namespace axlecast::saa_can
