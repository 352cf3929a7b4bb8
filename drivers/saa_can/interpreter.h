#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

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

// Returns the end of the event.
[[nodiscard]] constexpr MonoNs EndOf(const Event& event) {
  return event.sent.last > event.received.last ? event.sent.last : event.received.last;
}

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
  Interpreter(const SaaCanSettings& settings, MonoNs late, DeviceOutput& output);

  void OnLinkUp(MonoNs now);
  void OnLinkDown(MonoNs now);

  // The content of an event that a procedure needs.
  struct Evaluation {
    std::optional<Reading> reading;
    std::optional<Command> acknowledged;  // withheld: the reply to this command, or a position that looks like it
  };
  Evaluation Evaluate(const Event& event);

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
  [[nodiscard]] MonoNs due() const;
  // Returns the number of consecutive requests without a position, or of consecutive silences.
  [[nodiscard]] int silent_in_a_row() const { return silent_in_a_row_; }
  // Returns the time from which on a sampled reading shows the effect of the last clearing to zero; kNever while the
  // command may still wait in the controller's queue.
  [[nodiscard]] MonoNs effect_from() const { return effect_from_; }

 private:
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

  void OnOwnSent(const Event& event);
  [[nodiscard]] std::optional<PositionRequest> TakeAnswered();
  void OnConfirmed(const Event& event);
  // `on_bus_at`: kNever while the command is only in the queue.
  void OnCommand(const Request& request, MonoNs on_bus_at);
  [[nodiscard]] Window* WindowOf(Command command);
  [[nodiscard]] Evaluation OnData(const Event& event);
  [[nodiscard]] std::optional<Command> Withhold(const Event& event);
  void ReportOverdue(const Event& event);
  void OnAcknowledged(Command command);
  void EndJump();
  // `request`: kSingle, the request that the frame answers.
  [[nodiscard]] Interval SampledAt(const Event& event, const std::optional<PositionRequest>& request) const;

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
