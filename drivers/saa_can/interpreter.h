#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <utility>

#include "core/base/time.h"
#include "core/device/device.h"
#include "core/device/step.h"
#include "drivers/kit/stream.h"
#include "drivers/saa_can/settings.h"

namespace axlecast::saa_can {

// Keeps one request under way, although a position does not show to which request it belongs. A position that came without
// a request would permit the next request too early, and would leave two under way for good. Therefore, after an answer
// that came much sooner than usual, the next request also waits for the right answer.
class AnswerPace {
 public:
  void OnRequest(MonoNs now) {
    // Nothing else came: the early answer was the right one.
    if (early_) usual_ -= (usual_ - early_took_) / kQuickForgetting;
    early_ = false;
    requested_at_ = now;
    free_at_ = now;
  }
  // A position came while one was awaited.
  void OnAnswer(MonoNs now) {
    const MonoNs took = now - requested_at_;
    early_ = took * 4 < usual_ * 3;
    if (early_) {
      early_took_ = took;
      free_at_ = requested_at_ + usual_ + usual_ / 4;
    } else {
      usual_ = std::max(took, usual_ - (usual_ - took) / kForgetting);
    }
  }
  // A position came while none was awaited. After an early answer it is the right one.
  void OnUnrequested(MonoNs now) {
    early_ = false;
    free_at_ = now;
  }
  // Returns when the next request may be sent.
  [[nodiscard]] MonoNs free_at() const { return free_at_; }

 private:
  static constexpr MonoNs kForgetting = 16;
  static constexpr MonoNs kQuickForgetting = 4;

  MonoNs usual_ = 0;  // from a request to its answer: near the longest recent time
  MonoNs requested_at_ = 0;
  MonoNs free_at_ = 0;
  bool early_ = false;
  MonoNs early_took_ = 0;
};

// A position, or the error in its frame.
struct Reading {
  std::optional<ErrorKind> error;
  std::uint32_t counts = 0;
  Interval at;  // of a position: contains the sampling time; otherwise of the frame
};

// These commands request a position. All others may change something that the encoder stores: they count as wear, because
// the manual does not exclude it.
inline bool IsForPosition(Command command) { return command == Command::kRead || command == Command::kStart; }
// These commands change the position without motion.
inline bool MovesDatum(Command command) { return command == Command::kZero || command == Command::kDirection; }

// Evaluates the frames of the encoder for the output: samples, errors by kind, and the jump of the position after it was
// cleared to zero. All of this follows from the events alone, not from who sent the commands. So a recorded sequence of events
// gives the same results again.
//
// On 1NN, positions and replies look alike (codec.h, MayAcknowledge). From the time at which a command is handed to the
// controller until `reply_window` after it was on the bus, whatever may be its reply is withheld: it is no sample. The
// first such frame is taken for the reply. Every further one in that time was surely a position, and is counted as `busy`.
// Commands of another master on the bus, which are received on 2NN, open the same window.
class Interpreter {
 public:
  // `late`: kSingle, longest time from a request to its answer.
  Interpreter(const SaaCanSettings& settings, MonoNs late, DeviceOutput& output)
      : settings_(settings),
        late_(late),
        output_(output),
        period_(settings.period),
        monitor_(period_ + settings.latency, kPeriodsToSilence) {}

  void OnLinkUp(MonoNs now) {
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
  void OnLinkDown(MonoNs now) {
    // What was in the controller's queue is gone with the interface, or was on the bus.
    if (jumping_ && effect_from_ == kNever) effect_from_ = now + settings_.zero_settle;
    answering_ = false;
    request_.reset();
    unconfirmed_ = false;
  }

  // The content of an event that a procedure needs.
  struct Evaluation {
    std::optional<Reading> reading;
    std::optional<Command> acknowledged;  // withheld: the reply to this command, or a position that looks like it
    bool overdue = false;                 // no position came in time
  };
  Evaluation Evaluate(const Event& event) {
    now_ = std::max(now_, event.End());
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
    evaluation.overdue = ReportOverdue(event);
    return evaluation;
  }

  // Returns whether frames of the encoder come. False before the first one after the link came up, and after silence.
  [[nodiscard]] bool answering() const { return answering_; }
  // Returns, in mode kSingle, whether a position was requested and may still come.
  [[nodiscard]] bool awaiting() const { return request_.has_value(); }
  // Returns, in mode kSingle, when the next request may be sent.
  [[nodiscard]] MonoNs next_request_at() const { return std::max(quiet_until_, pace_.free_at()); }
  // Returns whether an own frame is in the controller's queue that no node has acknowledged yet.
  [[nodiscard]] bool unconfirmed() const { return unconfirmed_; }
  // Returns the period of the positions, as configured or as the last acknowledged command has set it.
  [[nodiscard]] MonoNs period() const { return period_; }
  // Returns when the next position is overdue.
  [[nodiscard]] MonoNs due() const {
    if (settings_.mode == Mode::kCyclic) return monitor_.due();
    if (!request_) return kNever;
    return request_->at + (request_->missed ? late_ : settings_.timeout);
  }
  // Returns the number of consecutive requests without a position, or of consecutive silences.
  [[nodiscard]] int silent_in_a_row() const { return silent_in_a_row_; }
  // Returns the time from which on a sampled reading shows the effect of the last clearing to zero; kNever while the
  // command may still wait in the controller's queue.
  [[nodiscard]] MonoNs effect_from() const { return effect_from_; }

 private:
  // The manual's own log shows a period of 106.4 ms where 100 ms is set: three nominal periods are more than two real ones.
  static constexpr int kPeriodsToSilence = 3;
  // Consecutive requests without a position, after which the encoder counts as gone.
  static constexpr int kGone = 2;

  // The time in which a command may be answered.
  struct Window {
    MonoNs until = 0;       // kNever: it is not on the bus yet
    bool answered = false;  // the frame that is taken for the reply has come
  };

  // A request for a position that may still be answered.
  struct PositionRequest {
    MonoNs sent = 0;
    MonoNs at = 0;
    bool missed = false;
  };

  void OnOwnSent(const Event& event) {
    const std::optional<Request> request = ParseRequest(event.bytes);
    if (!request) return;
    unconfirmed_ = true;
    if (!IsForPosition(request->command)) return OnCommand(*request, kNever);
    if (settings_.mode != Mode::kSingle) return;
    pace_.OnRequest(now_);
    request_ = {.sent = event.received.first, .at = now_};
  }
  // The request that a position answers, if one was sent.
  [[nodiscard]] std::optional<PositionRequest> TakeAnswered() {
    request_ ? pace_.OnAnswer(now_) : pace_.OnUnrequested(now_);
    return std::exchange(request_, std::nullopt);
  }
  void OnConfirmed(const Event& event) {
    unconfirmed_ = false;
    const std::optional<Request> request = ParseRequest(event.bytes);
    if (!request) return;
    if (request_ && IsForPosition(request->command)) request_->at = now_;
    if (Window* window = WindowOf(request->command)) window->until = now_ + settings_.reply_window;
    if (MovesDatum(request->command) && jumping_) effect_from_ = now_ + settings_.zero_settle;
  }
  // `on_bus_at`: kNever while the command is only in the queue.
  void OnCommand(const Request& request, MonoNs on_bus_at) {
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
  [[nodiscard]] Window* WindowOf(Command command) {
    const auto* const found = std::find(kAcknowledged.begin(), kAcknowledged.end(), command);
    if (found == kAcknowledged.end()) return nullptr;
    return &windows_.at(static_cast<std::size_t>(found - kAcknowledged.begin()));
  }
  [[nodiscard]] Evaluation OnData(const Event& event) {
    answering_ = true;
    silent_in_a_row_ = 0;
    if (settings_.mode == Mode::kCyclic) monitor_.Arrived(now_);
    if (const auto command = Withhold(event)) return {.reading = {}, .acknowledged = command, .overdue = false};
    const std::optional<PositionRequest> request = TakeAnswered();
    const Position position = ParsePosition(event.bytes, settings_.format);
    Reading reading{.error = {}, .counts = position.counts, .at = event.received};
    if (position.error != PositionError::kNone) {
      reading.error = position.error == PositionError::kShort ? ErrorKind::kShort : ErrorKind::kRange;
      output_.OnError(*reading.error, event.received);
      return {.reading = reading, .acknowledged = {}, .overdue = false};
    }
    reading.at = SampledAt(event, request);
    if (jumping_ && reading.at.first >= effect_from_) EndJump();
    output_.OnSample({.at = reading.at, .counts = reading.counts});
    return {.reading = reading, .acknowledged = {}, .overdue = false};
  }
  [[nodiscard]] std::optional<Command> Withhold(const Event& event) {
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
  // Returns whether a position has become overdue.
  bool ReportOverdue(const Event& event) {
    if (settings_.mode == Mode::kCyclic) {
      if (!monitor_.FellSilent(now_)) return false;
      ++silent_in_a_row_;
      answering_ = false;
      output_.OnError(ErrorKind::kSilent, event.received);
      return true;
    }
    if (!request_) return false;
    const bool overdue = !request_->missed && now_ >= request_->at + settings_.timeout;
    if (overdue) {
      request_->missed = true;
      if (++silent_in_a_row_ >= kGone) answering_ = false;
      output_.OnError(ErrorKind::kTimeout, event.received);
    }
    // Until then the answer may come late, and could be taken for that to another request.
    if (now_ >= request_->at + late_) request_.reset();
    return overdue;
  }
  void OnAcknowledged(Command command) {
    if (command != Command::kPeriod || per_second_sent_ == 0 || settings_.mode != Mode::kCyclic) return;
    period_ = kSecond / per_second_sent_;
    monitor_ = PeriodMonitor(period_ + settings_.latency, kPeriodsToSilence);
    monitor_.Arrived(now_);
  }
  void EndJump() {
    jumping_ = false;
    output_.OnDatumChanging(false);
    output_.OnJump();
  }
  // `request`: kSingle, the request that the frame answers.
  // The kernel sets the timestamp of a frame when its last bit but one was on the bus, or later. The position was sampled at
  // most `latency` before the first bit of the frame; in this time, the frame also waits for a busy bus. An adapter that
  // delays an answer sets its timestamp too late. Even then, the position was sampled at most `latency` before its request.
  [[nodiscard]] Interval SampledAt(const Event& event, const std::optional<PositionRequest>& request) const {
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

  const SaaCanSettings& settings_;
  const MonoNs late_;
  DeviceOutput& output_;
  MonoNs period_;
  PeriodMonitor monitor_;

  MonoNs now_ = 0;  // of the newest event: the confirmation of a frame may follow a frame that came later
  bool answering_ = false;
  int silent_in_a_row_ = 0;
  std::optional<PositionRequest> request_;
  MonoNs quiet_until_ = 0;  // answers to an earlier process may come until then
  AnswerPace pace_;
  bool unconfirmed_ = false;
  std::array<Window, kAcknowledged.size()> windows_;
  std::uint8_t per_second_sent_ = 0;  // TT of the last 31 NN; 0: none, or one that stops
  bool jumping_ = false;
  MonoNs effect_from_ = 0;
};

}  // namespace axlecast::saa_can
