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

// Keeps one request under way, though nothing in a position says to which request it belongs. One that came unasked
// would let the next request out too early, and leave two under way for good. So after an answer that came much sooner
// than usual the right one is waited for as well.
class AnswerPace {
 public:
  void Asked(MonoNs now) {
    // Nothing else came: the early answer was the right one.
    if (early_) usual_ -= (usual_ - early_took_) / kQuickForgetting;
    early_ = false;
    asked_at_ = now;
    free_at_ = now;
  }
  // A position came while one was awaited.
  void Answered(MonoNs now) {
    const MonoNs took = now - asked_at_;
    early_ = took * 4 < usual_ * 3;
    if (early_) {
      early_took_ = took;
      free_at_ = asked_at_ + usual_ + usual_ / 4;
    } else {
      usual_ = std::max(took, usual_ - (usual_ - took) / kForgetting);
    }
  }
  // One came while none was awaited: the right one, after an early one.
  void CameUnasked(MonoNs now) {
    early_ = false;
    free_at_ = now;
  }
  // The next request may go out then.
  [[nodiscard]] MonoNs free_at() const { return free_at_; }

 private:
  static constexpr MonoNs kForgetting = 16;
  static constexpr MonoNs kQuickForgetting = 4;

  MonoNs usual_ = 0;  // from a request to its answer, rather the longest lately
  MonoNs asked_at_ = 0;
  MonoNs free_at_ = 0;
  bool early_ = false;
  MonoNs early_took_ = 0;
};

// A position, or why there is none.
struct Reading {
  std::optional<ErrorKind> error;
  std::uint32_t counts = 0;
  Interval at;  // of a position: holds the sampling instant; else of the frame
};

// When what the event tells was over.
[[nodiscard]] constexpr MonoNs EndOf(const Event& event) {
  return event.sent.last > event.received.last ? event.sent.last : event.received.last;
}

// What the encoder says, towards the outside: samples, errors by kind, and where its position jumps because it was
// cleared to zero. All of it follows from the events alone, whoever sent the commands and why; so a recorded sequence
// of events gives the same again.
//
// On 1NN positions and replies look alike (codec.h, MayAcknowledge). From the moment at which a command is handed to
// the controller until `reply_window` after it was on the bus, whatever may be its reply is withheld: it is no sample.
// The first such frame passes for the reply; every further one in that time was a position for sure, and is counted
// as `busy`. Commands of another master on the bus, which are heard on 2NN, open the same window.
class Interpreter {
 public:
  // `late`: kSingle, longest time from a request to its answer.
  Interpreter(const SaaCanSettings& settings, MonoNs late, DeviceOutput& output);

  void OnLinkUp(MonoNs now);
  void OnLinkDown(MonoNs now);

  // What an event brought beside what was handed to the output.
  struct Heard {
    std::optional<Reading> reading;
    std::optional<Command> acknowledged;  // withheld: the reply to this command, or a position that looks like it
    bool frame = false;                   // of this encoder, whatever it said
  };
  Heard Take(const Event& event);

  // Frames of the encoder come: not before the first one after the link came up, and no more after silence.
  [[nodiscard]] bool answering() const { return answering_; }
  // kSingle: a position was asked for, and may still come.
  [[nodiscard]] bool awaiting() const { return asked_.has_value(); }
  // kSingle: the next request may go out then.
  [[nodiscard]] MonoNs next_request_at() const { return std::max(quiet_until_, pace_.free_at()); }
  // An own frame is in the controller's queue: nobody has acknowledged it yet.
  [[nodiscard]] bool unconfirmed() const { return unconfirmed_; }
  // Of the positions, as the file says or as the last acknowledged command has set it.
  [[nodiscard]] MonoNs period() const { return period_; }
  // When the next thing must be missed.
  [[nodiscard]] MonoNs due() const;
  // Requests in a row that brought nothing, or silences.
  [[nodiscard]] int silent_in_a_row() const { return silent_in_a_row_; }
  // A reading sampled at or after this instant shows the effect of the last clearing to zero; kNever while that may
  // still wait in the controller's queue.
  [[nodiscard]] MonoNs effect_from() const { return effect_from_; }

 private:
  // The time in which a command may be answered.
  struct Window {
    MonoNs until = 0;       // kNever: it is not on the bus yet
    bool answered = false;  // what passes for the reply has come
  };

  // A request for a position that may still be answered.
  struct Asked {
    MonoNs sent = 0;
    MonoNs at = 0;
    bool missed = false;
  };

  void OnOwnSent(const Event& event);
  [[nodiscard]] std::optional<Asked> TakeAnswered();
  void OnConfirmed(const Event& event);
  void OnCommand(const Request& request, MonoNs on_bus_at);
  [[nodiscard]] Heard OnData(const Event& event);
  [[nodiscard]] Heard OnPosition(const Event& event);
  [[nodiscard]] std::optional<Command> Withhold(const Event& event);
  void MissWhatIsDue(const Event& event);
  void OnAcknowledged(Command command);
  void BeginJump(MonoNs effect_from);
  void EndJump();
  // `asked`: kSingle, the request that the frame answers.
  [[nodiscard]] Interval SampledAt(const Event& event, const std::optional<Asked>& asked) const;

  const SaaCanSettings& settings_;
  const MonoNs late_;
  DeviceOutput& output_;
  MonoNs period_;
  PeriodMonitor cadence_;

  MonoNs now_ = 0;  // of the newest event: a frame that was acknowledged may be told before one that came earlier
  bool answering_ = false;
  int silent_in_a_row_ = 0;
  std::optional<Asked> asked_;
  MonoNs quiet_until_ = 0;  // answers to an earlier process may come until then
  AnswerPace pace_;
  bool unconfirmed_ = false;
  std::array<Window, kAcknowledged.size()> windows_;
  std::uint8_t per_second_ordered_ = 0;  // TT of the last 31 NN; 0: none, or one that stops
  bool jumping_ = false;
  MonoNs effect_from_ = 0;
};

}  // namespace axlecast::saa_can
