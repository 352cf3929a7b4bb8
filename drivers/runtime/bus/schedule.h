#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/time.h"
#include "core/device/device.h"
#include "core/device/line_settings.h"

namespace axlecast {

// Absolute slots on CLOCK_MONOTONIC: phase + k x period, the same instants on every bus with the same figures.
// A slot that was missed is counted as late and skipped; slots never come in bursts. Period 0: always due.
class SlotClock {
 public:
  SlotClock(MonoNs period, MonoNs phase) : period_(period), phase_(phase) {}

  // Begins with the first slot at or after `now`; earlier ones do not count as late.
  void Start(MonoNs now);

  [[nodiscard]] bool Due(MonoNs now) const { return now >= next_; }
  [[nodiscard]] MonoNs next() const { return next_; }

  // The slot that is due at `now` is used: that which began last. Those before it were missed.
  void Take(MonoNs now);
  // Slots before `until` may pass unused: whom they are for does not want them.
  void Excuse(MonoNs until) { excused_until_ = until; }

  [[nodiscard]] std::int64_t late() const { return late_; }

 private:
  MonoNs period_;
  MonoNs phase_;
  MonoNs next_ = 0;  // start of the next slot; with period 0 the past
  MonoNs excused_until_ = 0;
  std::int64_t late_ = 0;
};

struct ScheduleSettings {
  MonoNs period = 0;  // of each device's live slots; 0: as fast as the bus allows
  MonoNs phase = 0;
  // One turn in so many belongs to trip and slow items, however much the live readings want.
  std::int64_t reserve_every = 128;
  // A device that has not answered with a single byte for `silent_after` exchanges gets its next live slot only
  // after a pause, which doubles from `pause_first` to `pause_most`.
  int silent_after = 4;
  MonoNs pause_first = 1 * kMillisecond;
  MonoNs pause_most = 100 * kMillisecond;
  // While another device of the bus answers, the pause doubles up to this instead, and is never shorter than
  // `pause_costs` times the time that the vain request took: a silent device costs the others little.
  MonoNs pause_most_shared = 100 * kMillisecond;
  int pause_costs = 0;
  Pacing pacing = {};
  LineFormat line = {};  // how long a request takes on the wire
};

// Whose turn it is on a bus: a stop that waits for no idle line, a silence that somebody needs, then stop, command,
// live, trip, slow; round robin between the devices of one class. Of those that only listen, the one that listens the
// shortest: all of them hear.
//
// Orders never starve readings. Between two live turns of a device, while a live reading of that device is due:
// - orders take at most one turn for each device of the bus; then the device is read before the next order.
// - stops go before readings, but take at most four turns for each device of the bus.
class Schedule {
 public:
  // `pending` holds exchanges back, and may be null.
  explicit Schedule(const ScheduleSettings& settings, const PendingReplies* pending = nullptr)
      : settings_(settings), pending_(pending) {}

  void Add(Device& device);
  // The link came up: slots and pauses begin afresh.
  void Start(MonoNs now);

  struct Choice {
    std::size_t device = 0;  // by order of Add
    Step step;               // Idle: nobody wants to transmit or to listen
    MonoNs until = kNever;   // the schedule must be asked again by then
    bool live = false;       // the step uses the device's live slot
  };
  // Valid until the next call. Asking uses nothing up.
  [[nodiscard]] const Choice& Choose(MonoNs now);

  // The chosen step is about to be carried out.
  void Started(MonoNs now);
  // How the exchange of a device ended; a broadcast, which nobody answers, is an exchange too.
  void Ended(std::size_t device, const Event& event, MonoNs now);

  [[nodiscard]] Device& device(std::size_t index) const { return *entries_[index].device; }
  [[nodiscard]] std::size_t size() const { return entries_.size(); }
  [[nodiscard]] std::int64_t late() const;  // live slots that were missed, over all devices

  // A device that wants to be asked again at an instant that has passed waits this long: an idle bus never spins.
  static constexpr MonoNs kShortestIdle = 50 * kMicrosecond;

 private:
  static constexpr std::size_t kRanks = 9;

  struct Entry {
    Device* device;
    SlotClock slots;
    // The turn at which it was asked last in each class: who has waited for longest goes first.
    std::array<std::int64_t, kRanks> asked{};
    int timeouts = 0;         // in a row
    MonoNs paused_until = 0;  // while another device answers
    MonoNs soon_until = 0;    // the pause while no device answers
    MonoNs free_at = 0;       // what Pacing asks for this device
    std::size_t orders = 0;   // turns of orders since its last live turn
  };
  struct Best {
    std::size_t rank = kRanks;
    std::int64_t asked = 0;  // the turn at which it was asked last in its class
    MonoNs until = kNever;   // of one that listens
  };

  // Which steps are looked for.
  enum class Look : std::uint8_t { kAll, kOverdue, kOverdueByStops, kSlow };

  [[nodiscard]] Best Find(Look look, MonoNs now);
  [[nodiscard]] bool TakeShare(const Best& best, MonoNs now);
  [[nodiscard]] int FailuresOfTheMissing() const;
  [[nodiscard]] bool Overdue(const Entry& entry, std::size_t rank) const;
  [[nodiscard]] MonoNs PausedUntil(const Entry& entry) const;
  [[nodiscard]] bool LiveDue(const Entry& entry, MonoNs now) const;
  void OnSilent(Entry& entry, const Event& event, MonoNs now);
  [[nodiscard]] MonoNs HeldBack(const Entry& silent, MonoNs now) const;
  void OnAnswered(Entry& entry);
  void Pace(Entry& entry, const Event& event);
  void Consider(std::size_t index, MonoNs now, Look look, Best& best);
  void AskAgain(Entry& entry, const Step& step, MonoNs now, bool poll_due);
  [[nodiscard]] Step Ask(const Entry& entry, MonoNs now, bool poll_due, bool reserved) const;

  ScheduleSettings settings_;
  const PendingReplies* pending_;
  std::vector<Entry> entries_;
  Choice choice_;
  std::size_t rank_ = 0;       // of the choice
  std::size_t answering_ = 0;  // devices with fewer failures in a row than FailuresOfTheMissing
  MonoNs free_at_ = 0;         // what Pacing asks for the whole bus
  std::int64_t turns_ = 0;
};

}  // namespace axlecast
