#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/time.h"
#include "core/device/device.h"
#include "core/device/line_settings.h"
#include "drivers/runtime/bus/slot_clock.h"

namespace axlecast {

struct ScheduleSettings {
  Ticks ticks;                       // of each device's live slots; without ticks, as fast as the bus allows
  const BaseClaims* base = nullptr;  // the time base of the machine: see SlotClock
  // One bus slot in this many is reserved for trip and slow items.
  std::int64_t reserve_every = 128;
  // A device that has not answered with a single byte for `silent_after` exchanges gets its next live slot after a
  // pause, which doubles from `pause_first` to `pause_max`.
  int silent_after = 4;
  MonoNs pause_first = 1 * kMillisecond;
  MonoNs pause_max = 100 * kMillisecond;
  // While another device of the bus answers, the pause doubles up to this value instead. It is at least `pause_costs`
  // times the duration of the unanswered request, so that a silent device takes little time from the others.
  MonoNs pause_max_shared = 100 * kMillisecond;
  int pause_costs = 0;
  Pacing pacing = {};
  LineFormat line = {};  // determines how long a request takes on the wire
};

// Selects the next step on a bus. The order of priorities is: a stop that needs no idle line, a wait for an idle line, then
// stop, command, live, trip, slow. Devices with equal priority are polled round-robin. If devices only listen, the shortest
// listening time is used, since all of them receive.
//
// Commands never starve readings. Between two live slots of a device, while a live reading of that device is due:
// - Commands use at most one slot for each device of the bus. Then the device is read before the next command.
// - Stops go before readings, but use at most four slots for each device of the bus.
class Schedule {
 public:
  // `pending` delays exchanges; it may be null.
  explicit Schedule(const ScheduleSettings& settings, const PendingReplies* pending = nullptr)
      : settings_(settings), pending_(pending) {}

  void Add(Device& device);
  // Restarts slots and pauses: the link came up.
  void Start(MonoNs now);

  struct Choice {
    std::size_t device = 0;  // in the order of Add
    Step step;               // Idle: no device transmits or listens
    MonoNs until = kNever;   // Choose must be called again by then
    bool live = false;       // the step uses the device's live slot
  };
  // Returns the next step. Valid until the next call. Has no effect until Started is called.
  [[nodiscard]] const Choice& Choose(MonoNs now);

  // Reports that the chosen step is about to be executed. Returns the number of the tick for which it was chosen; kNoTick if it uses
  // no live slot, or the number is not known.
  std::int64_t Started(MonoNs now);
  // Reports how the exchange of a device ended. A broadcast, which is not answered, is an exchange too.
  void Ended(std::size_t device, const Event& event, MonoNs now);

  [[nodiscard]] Device& device(std::size_t index) const { return *entries_[index].device; }
  [[nodiscard]] std::size_t size() const { return entries_.size(); }
  [[nodiscard]] std::int64_t late() const;  // live slots that were missed, over all devices

  // The minimum wait if a device is due at a time that has passed. It prevents an idle bus from spinning.
  static constexpr MonoNs kMinIdle = 50 * kMicrosecond;

 private:
  static constexpr std::size_t kRanks = 9;

  struct Entry {
    Device* device;
    SlotClock slots;
    // The number of the last slot in each rank. The device that has waited longest is first.
    std::array<std::int64_t, kRanks> asked{};
    int timeouts = 0;          // consecutive
    MonoNs paused_until = 0;   // while another device answers
    MonoNs soon_until = 0;     // the pause while no device answers
    MonoNs free_at = 0;        // from Pacing, for this device
    std::size_t commands = 0;  // slots of commands since its last live slot
  };
  struct Best {
    std::size_t rank = kRanks;
    std::int64_t asked = 0;  // the number of its last slot in its rank
    MonoNs until = kNever;   // of a device that listens
  };

  // Which steps are searched.
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
  MonoNs free_at_ = 0;         // from Pacing, for the whole bus
  std::int64_t slots_ = 0;
};

}  // namespace axlecast
