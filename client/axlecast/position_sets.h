// For consumers that need several axes at one instant: joins the POSITION messages of one tick to a position_set_t, which states how far
// apart the axes were sampled. `axlecast sets` publishes the sets of the machine file with it. Header only, C++17, reads no clock and
// needs no LCM library.
//
//   axlecast::PositionSetBuilder sets(options);
//   ... in the handler of POSITION/<device>:  sets.OnPosition(axis, message, now_ns);   // now_ns: CLOCK_MONOTONIC of this host
//   ... then, and every few ms:               while (const auto* set = sets.Next(now_ns)) use(*set);
//
// Not thread-safe. Cost: O(axes) per set.
#pragma once

#include <axlecast/time_base.h>

#include <array>
#include <axlecast/position_set_t.hpp>
#include <axlecast/position_t.hpp>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace axlecast {

class PositionSetBuilder {
 public:
  struct Axis {
    std::string device;
    std::int64_t ticks = 1;  // of its bus from one tick of the set to the next
  };

  struct Options {
    std::string name;            // of the set
    std::vector<Axis> axes;      // at most position_set_t::MAX_AXES; more are ignored
    std::int64_t period_ns = 0;  // tick k of the set is at phase_ns + k x period_ns of the base
    std::int64_t phase_ns = 0;
    std::int64_t limit_ns = 0;  // a wider hull is not aligned
    // All axes are read by one host: their instants are compared on its CLOCK_MONOTONIC, without a time base.
    bool one_host = true;
    // Of several hosts, or for tick_ns of one host whose ticks are of the time base. It outlives the builder. Null: no time base.
    const TimeBase* time = nullptr;
    std::int64_t machine_id = 0;  // messages that state another machine are ignored; 0: all machines are taken
    std::int64_t wait_ns =
        0;  // for the missing axes of a tick, from its first message; 0: two periods, at least 20 ms
  };

  struct Totals {
    std::int64_t sets = 0;
    std::int64_t late = 0;     // messages of a tick whose set had been closed; that axis is missing there
    std::int64_t no_tick = 0;  // messages without a usable number of a tick of the set
  };

  static constexpr std::size_t kOpen = 64;  // sets that wait for messages

  explicit PositionSetBuilder(Options options);

  // `axis`: index into Options::axes.
  void OnPosition(std::size_t axis, const position_t& message, std::int64_t now_ns);
  // Returns the next set that is complete, or whose missing axes no longer come, in the order of the ticks; null: none. The sender sets
  // utime, mono_ns, boot_id, seq, machine_id and clock_id. Valid until the next call.
  [[nodiscard]] const position_set_t* Next(std::int64_t now_ns);
  // Returns the instant at which Next has to be called again at the latest; INT64_MAX: no set waits.
  [[nodiscard]] std::int64_t NextAt() const;
  [[nodiscard]] const Totals& totals() const { return totals_; }

 private:
  struct Reading {
    bool present = false;
    bool valid = false;
    std::int64_t boot_id = 0;
    std::int64_t clock_id = 0;
    std::int64_t base_id = 0;
    std::int64_t at = 0;           // middle of the interval, on the base of the set
    std::int64_t half_width = -1;  // -1: unknown
    std::int64_t on_base = -1;     // the same instant on the time base; -1: unknown
    std::int64_t counts = 0;
    double value = 0;
    double speed_rad_s = 0;
    std::int32_t datum_epoch = 0;
    std::int32_t flags = 0;
    std::int8_t unit = 0;
  };
  struct Open {
    std::int64_t tick = -1;
    std::int64_t since = 0;  // arrival of its first message
    std::size_t present = 0;
    std::array<Reading, position_set_t::MAX_AXES> axes{};
  };

  [[nodiscard]] bool IsSane(const position_t& message) const;
  [[nodiscard]] Open* Find(std::int64_t tick, std::int64_t now_ns);
  [[nodiscard]] Reading Take(const position_t& message, std::int64_t now_ns) const;
  [[nodiscard]] bool IsOver(const Open& open, std::int64_t now_ns) const;
  void Write(const Open& open);
  [[nodiscard]] const Reading* Reference(const Open& open) const;
  [[nodiscard]] std::int8_t StateOf(const Reading& reading, const Reading* reference) const;

  Options options_;
  Totals totals_;
  std::array<Open, kOpen> open_{};  // in the order of the ticks
  std::size_t size_ = 0;
  std::int64_t closed_ = -1;                                   // tick of the newest set that was returned
  std::array<std::int64_t, position_set_t::MAX_AXES> newest_;  // tick of the newest message of each axis
  position_set_t message_{};
};

inline PositionSetBuilder::PositionSetBuilder(Options options) : options_(std::move(options)) {
  constexpr std::int64_t kLeastWait = 20'000'000;
  if (options_.axes.size() > std::size_t{position_set_t::MAX_AXES}) options_.axes.resize(position_set_t::MAX_AXES);
  if (options_.wait_ns <= 0) {
    options_.wait_ns = 2 * options_.period_ns > kLeastWait ? 2 * options_.period_ns : kLeastWait;
  }
  newest_.fill(-1);
  message_.set = options_.name;
  message_.period_ns = options_.period_ns;
  message_.limit_ns = options_.limit_ns;
  message_.n = static_cast<std::int8_t>(options_.axes.size());
  message_.axes.resize(options_.axes.size());
  for (std::size_t i = 0; i < options_.axes.size(); ++i) message_.axes[i].device = options_.axes[i].device;
}

// Returns the open set of the tick, a new one if it has none; null if it was closed.
inline PositionSetBuilder::Open* PositionSetBuilder::Find(std::int64_t tick, std::int64_t now_ns) {
  std::size_t place = size_;
  while (place > 0 && open_[place - 1].tick >= tick) --place;
  if (place < size_ && open_[place].tick == tick) return &open_[place];
  if (tick <= closed_ || size_ == kOpen) return nullptr;
  for (std::size_t i = size_; i > place; --i) open_[i] = open_[i - 1];
  ++size_;
  open_[place] = Open{};
  open_[place].tick = tick;
  open_[place].since = now_ns;
  return &open_[place];
}

inline PositionSetBuilder::Reading PositionSetBuilder::Take(const position_t& message, std::int64_t now_ns) const {
  Reading reading;
  reading.present = true;
  reading.valid = (message.flags & position_t::FLAG_VALID) != 0;
  reading.boot_id = message.boot_id;
  reading.clock_id = message.clock_id;
  reading.counts = message.counts;
  reading.value = message.value;
  reading.speed_rad_s = message.speed_rad_s;
  reading.datum_epoch = message.datum_epoch;
  reading.flags = message.flags;
  reading.unit = message.unit;
  TimeBase::Instant base;
  if (options_.time != nullptr) base = options_.time->OnBase(message.clock_id, message.mono_ns, now_ns);
  if (base) reading.on_base = base.ns;
  if (options_.one_host) {
    reading.at = message.mono_ns;
    reading.half_width = message.time_uncertainty_ns;
  } else if (base) {
    reading.at = base.ns;
    reading.half_width = base.half_width_ns + message.time_uncertainty_ns;
    reading.base_id = base.base_id;
  }
  return reading;
}

// Sums of such instants do not overflow. Anybody on the network can send others.
inline bool PositionSetBuilder::IsSane(const position_t& message) const {
  constexpr std::int64_t kLatest = INT64_MAX / 16;  // ns: 18 years
  return options_.period_ns > 0 && message.tick >= 0 && message.tick < kLatest / options_.period_ns &&
         message.mono_ns >= 0 && message.mono_ns < kLatest && message.time_uncertainty_ns >= 0;
}

inline void PositionSetBuilder::OnPosition(std::size_t axis, const position_t& message, std::int64_t now_ns) {
  constexpr std::int64_t kAnotherBase = 1'000'000'000;  // ns: ticks so far back are of another base
  if (axis >= options_.axes.size()) return;
  if (options_.machine_id != 0 && message.machine_id != 0 && message.machine_id != options_.machine_id) return;
  const std::int64_t ticks = options_.axes[axis].ticks > 0 ? options_.axes[axis].ticks : 1;
  if (!IsSane(message) || message.tick % ticks != 0) {
    ++totals_.no_tick;
    return;
  }
  const std::int64_t tick = message.tick / ticks;
  if (closed_ - tick > kAnotherBase / options_.period_ns) {
    size_ = 0;
    closed_ = tick - 1;
    newest_.fill(-1);
  }
  newest_[axis] = tick;
  Open* open = Find(tick, now_ns);
  if (open == nullptr) {
    ++totals_.late;
    return;
  }
  Reading& reading = open->axes[axis];
  if (reading.present) {
    reading.valid = reading.valid && reading.boot_id == message.boot_id;  // else two drivers publish this device
    return;
  }
  reading = Take(message, now_ns);
  ++open->present;
}

// Messages of one device come in order: an axis that has sent a later tick no longer sends this one.
inline bool PositionSetBuilder::IsOver(const Open& open, std::int64_t now_ns) const {
  if (now_ns - open.since >= options_.wait_ns || size_ == kOpen) return true;
  for (std::size_t i = 0; i < options_.axes.size(); ++i) {
    if (!open.axes[i].present && newest_[i] <= open.tick) return false;
  }
  return true;
}

inline const position_set_t* PositionSetBuilder::Next(std::int64_t now_ns) {
  if (size_ == 0 || !IsOver(open_[0], now_ns)) return nullptr;
  Write(open_[0]);
  closed_ = open_[0].tick;
  for (std::size_t i = 1; i < size_; ++i) open_[i - 1] = open_[i];
  --size_;
  ++totals_.sets;
  return &message_;
}

inline std::int64_t PositionSetBuilder::NextAt() const {
  return size_ == 0 ? INT64_MAX : open_[0].since + options_.wait_ns;
}

// Returns the first reading whose instant is known: the others must be of its clock, or of its base.
inline const PositionSetBuilder::Reading* PositionSetBuilder::Reference(const Open& open) const {
  for (std::size_t i = 0; i < options_.axes.size(); ++i) {
    const Reading& reading = open.axes[i];
    if (reading.present && reading.half_width >= 0 && (!options_.one_host || reading.clock_id != 0))
      return &reading;
  }
  return nullptr;
}

inline std::int8_t PositionSetBuilder::StateOf(const Reading& reading, const Reading* reference) const {
  constexpr std::int64_t kFar = 2'000'000'000;  // ns: further from the tick, the fields of the message end
  if (!reading.present) return position_set_axis_t::STATE_MISSING;
  const bool comparable =
      reference != nullptr && reading.half_width >= 0 && reading.half_width < kFar &&
      (options_.one_host ? reading.clock_id == reference->clock_id : reading.base_id == reference->base_id);
  const std::int64_t offset = reading.at - message_.tick_ns;
  if (!comparable || offset >= kFar || offset <= -kFar) return position_set_axis_t::STATE_TIME_UNKNOWN;
  return reading.valid ? position_set_axis_t::STATE_GOOD : position_set_axis_t::STATE_NOT_VALID;
}

inline void PositionSetBuilder::Write(const Open& open) {
  const Reading* reference = Reference(open);
  message_.tick = open.tick;
  message_.tick_ns = options_.phase_ns + open.tick * options_.period_ns;
  message_.base_id = reference == nullptr || options_.one_host ? 0 : reference->base_id;
  // On one host, a tick of the time base lies as far from a reading as it does on the base.
  if (options_.one_host && options_.time != nullptr && reference != nullptr) {
    message_.tick_ns =
        reference->on_base < 0 ? reference->at : message_.tick_ns + reference->at - reference->on_base;
  }
  message_.earliest_ns = 0;
  message_.latest_ns = 0;
  std::size_t good = 0;
  for (std::size_t i = 0; i < options_.axes.size(); ++i) {
    const Reading& reading = open.axes[i];
    position_set_axis_t& axis = message_.axes[i];
    axis.state = StateOf(reading, reference);
    const bool located =
        axis.state == position_set_axis_t::STATE_GOOD || axis.state == position_set_axis_t::STATE_NOT_VALID;
    axis.offset_ns = located ? static_cast<std::int32_t>(reading.at - message_.tick_ns) : 0;
    axis.half_width_ns = located ? static_cast<std::int32_t>(reading.half_width) : reading.present ? -1 : 0;
    axis.counts = reading.counts;
    axis.value = reading.value;
    axis.unit = reading.unit;
    axis.speed_rad_s = reading.speed_rad_s;
    axis.datum_epoch = reading.datum_epoch;
    axis.flags = reading.flags;
    if (axis.state != position_set_axis_t::STATE_GOOD) continue;
    const std::int64_t earliest = reading.at - reading.half_width;
    const std::int64_t latest = reading.at + reading.half_width;
    if (good == 0 || earliest < message_.earliest_ns) message_.earliest_ns = earliest;
    if (good == 0 || latest > message_.latest_ns) message_.latest_ns = latest;
    ++good;
  }
  if (good < options_.axes.size()) {
    message_.state = position_set_t::STATE_INCOMPLETE;
  } else if (message_.latest_ns - message_.earliest_ns > options_.limit_ns) {
    message_.state = position_set_t::STATE_NOT_ALIGNED;
  } else {
    message_.state = position_set_t::STATE_ALIGNED;
  }
}

}  // namespace axlecast
