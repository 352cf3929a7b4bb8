#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "drivers/runtime/bus/slot_clock.h"
#include "drivers/runtime/core/device.h"
#include "drivers/runtime/core/line_format.h"

namespace axlecast {

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
  // And never sooner than this many times what asking it in vain took: so a silent device costs the others little.
  int pause_costs = 0;
  Pacing pacing = {};
  LineFormat line = {};  // how long a request takes on the wire
};

// Whose turn it is on a bus: a silence that somebody needs, then stop, command, live, trip, slow; round robin
// between the devices of one class. Of those that only listen, the one that listens the shortest: all of them hear.
class Schedule {
 public:
  explicit Schedule(const ScheduleSettings& settings) : settings_(settings) {}

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
  static constexpr std::size_t kRanks = 8;

  struct Entry {
    Device* device;
    SlotClock slots;
    int timeouts = 0;  // in a row
    MonoNs paused_until = 0;
    MonoNs free_at = 0;  // what Pacing asks for this device
  };
  struct Best {
    std::size_t rank = kRanks;
    std::size_t distance = 0;  // from the device that is next in its class
    MonoNs until = kNever;     // of one that listens
  };

  [[nodiscard]] bool ReservedTurn(MonoNs now);
  void Pace(Entry& entry, const Event& event);
  void Consider(std::size_t index, MonoNs now, bool live_due, Best& best);
  void AskAgain(Entry& entry, const Step& step, MonoNs now, bool live_due);

  ScheduleSettings settings_;
  std::vector<Entry> entries_;
  Choice choice_;
  std::size_t rank_ = 0;                    // of the choice
  MonoNs free_at_ = 0;                      // what Pacing asks for the whole bus
  std::array<std::size_t, kRanks> next_{};  // round robin within each class
  std::int64_t turns_ = 0;
};

}  // namespace axlecast
