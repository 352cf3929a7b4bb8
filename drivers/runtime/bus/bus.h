#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "core/base/exchange_stats.h"
#include "core/base/time.h"
#include "core/device/line_settings.h"
#include "core/device/link.h"
#include "drivers/runtime/bus/schedule.h"
#include "drivers/runtime/bus/stale_reply_guard.h"
#include "drivers/runtime/bus/transactor.h"
#include "drivers/runtime/bus/wire_log.h"

namespace axlecast {

// Receives changes of the link state, and the ticks of requests.
class BusObserver {
 public:
  virtual ~BusObserver() = default;
  // A reading is about to be requested in its slot. `device`: in the order of Add; kAllDevices for a frame that all answer. `tick`: the number
  // of its tick; kNoTick if it is not known.
  virtual void OnSlot(std::size_t /*device*/, std::int64_t /*tick*/) {}
  static constexpr std::size_t kAllDevices = SIZE_MAX;
  // The bus needs no time of the thread: a request was transmitted, or the bus waits. Called before each wait.
  virtual void OnWait() {}
  // `reason`: why the link is down, and what to do. Called again when the reason changes.
  virtual void OnLink(bool up, std::string_view reason, MonoNs now) = 0;
};

struct BusSettings {
  ScheduleSettings schedule;
  LineFormat wire = {};         // of a real line; without baud, replies may come faster than a wire carries them
  bool echo = false;            // the adapter receives its own transmission
  MonoNs late = 0;              // the longest time from a request to its reply; 0: replies are never late
  PulseLines* lines = nullptr;  // additional lines of the bus; opened and closed with its line
  // Pause before the line is opened again. It doubles with each failure.
  MonoNs reopen_first = 50 * kMillisecond;
  MonoNs reopen_max = 2 * kSecond;
};

// One bus and the devices on it: opens the line, executes the devices' steps, and delivers the events to the devices. Used
// by one thread.
class Bus {
 public:
  // `wire` may be null: then nothing is recorded.
  Bus(const BusSettings& settings, ByteLink& link, const Clock& clock, BusObserver& observer, WireLog* wire);
  Bus(const BusSettings& settings, FrameLink& link, const Clock& clock, BusObserver& observer, WireLog* wire);

  void Add(Device& device) {
    schedule_.Add(device);
    guard_->AddDevice();
  }

  // Runs one step, or sleeps until a step is due, `by` is reached, or the link is woken. Returns the present time. Waits
  // at most one exchange beyond `by`.
  MonoNs RunOnce(MonoNs by);

  struct Counters {
    std::int64_t exchanges = 0;  // requests transmitted, answered or not; on CAN, frames received
    std::int64_t losses = 0;     // times the open line was lost
    std::int64_t reopens = 0;    // how often the line was opened again
    Link::LineErrors line;       // since start
  };
  [[nodiscard]] Counters counters() const;
  [[nodiscard]] std::int64_t late() const { return schedule_.late(); }
  // Returns how many late replies of a device (in the order of Add) were recognised.
  [[nodiscard]] std::int64_t late_replies(std::size_t device) const { return guard_->late(device); }
  [[nodiscard]] bool up() const { return up_; }
  [[nodiscard]] bool ever_up() const { return opens_ > 0; }
  [[nodiscard]] const std::string& problem() const { return problem_; }    // why the line is down, or was down last
  [[nodiscard]] ExchangeStats& stats() { return stats_; }                  // completed exchanges
  [[nodiscard]] const ExchangeHistogram& times() const { return times_; }  // the same, since the start

 private:
  Bus(const BusSettings& settings, Link& link, std::unique_ptr<Transactor> transactor, const Clock& clock,
      BusObserver& observer, WireLog* wire);

  MonoNs Reopen(MonoNs by);
  void Down(const Event& event);
  [[nodiscard]] Result<> OpenAll();
  // Sets when the line is opened next.
  void Pause(MonoNs now);
  // Returns the errors since start.
  [[nodiscard]] Link::LineErrors LineErrors() const;
  MonoNs Transmit(const Schedule::Choice& choice, MonoNs now);
  void Start(const Schedule::Choice& choice, MonoNs now);
  MonoNs CarryOut(const Schedule::Choice& choice, MonoNs now, MonoNs by);
  MonoNs Deliver(const Event* event, std::size_t device, MonoNs now);
  void DeliverToAll(const Event& event);

  BusSettings settings_;
  Link& link_;
  const Clock& clock_;
  BusObserver& observer_;
  WireLog* wire_;
  std::unique_ptr<Transactor> transactor_;
  std::unique_ptr<StaleReplyGuard> guard_;  // used by the schedule
  Schedule schedule_;
  ExchangeStats stats_;
  ExchangeHistogram times_;

  bool up_ = false;
  MonoNs up_since_ = 0;
  MonoNs reopen_at_ = 0;
  MonoNs reopen_pause_ = 0;
  std::string problem_;
  std::int64_t opens_ = 0;
  std::int64_t exchanges_ = 0;
  std::int64_t losses_ = 0;
  Link::LineErrors closed_errors_;  // of the earlier times that the line was open
};

}  // namespace axlecast
