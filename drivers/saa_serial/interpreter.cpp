#include "drivers/saa_serial/interpreter.h"

#include <algorithm>
#include <utility>

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

}  // namespace

Interpreter::Interpreter(const BusConfig& bus, const SaaSettings& settings, DeviceOutput& output)
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

void Interpreter::OnLinkUp(MonoNs now) {
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

void Interpreter::OnLinkDown(bool zeroing, MonoNs now) {
  if (zeroing) BeginJump(now);
  answering_ = false;
  quiet_needed_ = 0;
}

void Interpreter::Take(const Event& event) {
  switch (event.kind) {
    case Event::Kind::kReply:
    case Event::Kind::kTimeout:
      if (settings_.zero_command && ParseRequest(event.request) == settings_.zero_command) {
        quiet_needed_ = event.bytes.empty() ? 0 : settings_.silence;
        BeginJump(EndOf(event));
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
      BeginJump(EndOf(event));
      break;
    case Event::Kind::kSilent:
      quiet_needed_ = 0;
      break;
    default:
      break;
  }
  if (mode_ == Mode::kTiming && cadence_.FellSilent(EndOf(event))) {
    answering_ = false;
    output_.OnError(ErrorKind::kSilent, event.received);
  }
}

void Interpreter::OnStream(const Event& event) {
  const MonoNs now = event.received.last;
  parser_.Append(event.bytes, {std::min(emptied_, now), now});
  stalled_.Arrived(now);
  // A read that was filled to the brim may have left bytes on the line.
  all_read_ = event.bytes.size() < kMaxFrame;
  if (all_read_) emptied_ = now;
  cadence_.Arrived(now);
}

void Interpreter::OnPolled(const Event& event) {
  const PolledReading polled = ReadReply(event, settings_.format, character_);
  polled_ = polled.reading;
  if (polled.stray > 0) output_.OnError(ErrorKind::kUnexpectedBytes, event.received);
  quiet_needed_ = 0;
  if (polled.reading.error) quiet_needed_ = settings_.silence;
  const bool silent = polled.reading.error == ErrorKind::kTimeout;
  silent_in_a_row_ = silent ? silent_in_a_row_ + 1 : 0;
  if (silent_in_a_row_ >= kGone) answering_ = false;
}

void Interpreter::OnStray(const Event& event) {
  output_.OnError(ErrorKind::kUnexpectedBytes, event.received);
  if (guards_line_) quiet_needed_ = std::max(quiet_needed_, settings_.silence);
}

std::optional<Reading> Interpreter::Next() {
  std::optional<Reading> reading = mode_ == Mode::kTiming ? NextOfStream() : std::exchange(polled_, std::nullopt);
  if (reading) Judge(*reading);
  return reading;
}

std::optional<Reading> Interpreter::NextOfStream() {
  std::optional<StreamParser::Found> found = parser_.Next();
  if (!found) return std::nullopt;
  if (!all_read_) found->behind.reset();
  if (found->error) return Reading{.error = found->error, .counts = 0, .at = found->first};
  const Interval at = stalled_.Widened(StreamedInstant(*found, ReplySize(settings_.format.bits), times_));
  return Reading{.error = {}, .counts = found->counts, .at = at};
}

void Interpreter::Judge(const Reading& reading) {
  if (reading.error) return output_.OnError(*reading.error, reading.at);
  answering_ = true;
  if (jumping_ && reading.at.first >= effect_from_) {
    jumping_ = false;
    output_.OnDatumChanging(false);
    output_.OnJump();
  }
  output_.OnSample({.at = reading.at, .counts = reading.counts});
}

void Interpreter::BeginJump(MonoNs now) {
  effect_from_ = now + settings_.zero_settle;
  output_.OnNonVolatileWrite();
  if (!std::exchange(jumping_, true)) output_.OnDatumChanging(true);
}

}  // namespace axlecast::saa_serial
