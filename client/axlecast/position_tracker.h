// For consumers of POSITION/<device>: age, staleness, loss, restart, change of datum, and the position at an
// instant between or shortly after the readings. Header only, C++17, reads no clock and needs no LCM library.
//
//   axlecast::PositionTracker axis;
//   ... in the handler of POSITION/axis1:  axis.OnPosition(message, now_ns);   // now_ns: CLOCK_MONOTONIC
//   ... in the handler of DEVICE/axis1:    axis.OnDevice(message);
//   ... in the control loop:               const auto position = axis.At(now_ns);
//                                          if (position && axis.Check(now_ns) == Freshness::kFresh)
//                                            use(position.value);
//
// Positions are advisory to safety systems: LCM has no authentication.
#pragma once

#include <axlecast/time_base.h>
#include <algorithm>
#include <array>
#include <axlecast/device_info_t.hpp>
#include <axlecast/position_t.hpp>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <string>

#include <unistd.h>

namespace axlecast {

// Returns FNV-1a, 64 bits, of the bytes of `text`, never 0: machine_id is that of the machine's name.
inline std::int64_t IdOfName(const std::string& text) {
  std::uint64_t hash = 0xCBF29CE484222325;
  for (const char character : text) {
    hash ^= static_cast<unsigned char>(character);
    hash *= 0x100000001B3;
  }
  return hash == 0 ? 1 : static_cast<std::int64_t>(hash);
}

// Returns clock_id of this process: its mono_ns is comparable with CLOCK_MONOTONIC here if a message has the same clock_id. 0:
// not known. Reads /proc once in a process. A service that does not see /proc/sys (ProcSubset=pid of systemd) needs
// Environment=AXLECAST_BOOT_ID=%b.
inline std::int64_t OwnClockId() {
  static const std::int64_t kOwn = [] {
    std::string text;
    std::ifstream boot("/proc/sys/kernel/random/boot_id");
    std::getline(boot, text);
    const char* given = std::getenv("AXLECAST_BOOT_ID");
    if (text.empty() && given != nullptr) text = given;
    text.erase(std::remove(text.begin(), text.end(), '-'), text.end());
    if (text.empty()) return std::int64_t{0};
    char space[64];
    const auto size = readlink("/proc/self/ns/time", space, sizeof space);
    if (size > 0) text.append(space, static_cast<std::size_t>(size));
    return IdOfName(text);
  }();
  return kOwn;
}

class PositionTracker {
 public:
  struct Options {
    // Older readings are stale. 0: device_info_t.max_age_us, as soon as a DEVICE message came.
    std::int64_t max_age_ns = 0;
    // At answers up to this long after the newest reading. -1: two periods of the device (DEVICE: the longest of poll_us, publish_us
    // and, if poll_us is 0, a third of max_age_us), at least 5 ms.
    std::int64_t max_extrapolation_ns = -1;
    // At does not interpolate between readings further apart. -1: three periods of the device, at least 50 ms.
    std::int64_t max_gap_ns = -1;
    // Messages that state another machine are ignored: IdOfName(name). 0: the machine of the first message.
    std::int64_t machine_id = 0;
    // Messages with this clock_id have instants on the clock of the caller.
    std::int64_t clock_id = OwnClockId();
    // Converts the instants of readings of other hosts to the clock of the caller: pass the TIME messages to it. It must exist as long as
    // the tracker. Null: readings of other hosts are not used.
    const TimeBase* time = nullptr;
    // A reading of another host is used if its instant is known to +- this. There is no default: it depends on the axis. At 100 turns
    // per minute and 17 bits, 1 us is 0.2 counts.
    std::int64_t max_time_half_width_ns = 0;
    // What counts as the instant of a reading.
    enum class Instant {
      kSampled,  // mono_ns, converted by `time` if the publisher runs on another host
      kReceived,  // the arrival of the message: an age is the least that it can be, and instants of axes are not comparable
      kGiven,  // the second argument of OnPosition is the sampling instant: from a log
    };
    Instant instant = Instant::kSampled;
  };

  enum class Freshness {
    kFresh,
    kStale,         // the newest valid reading is too old
    kNotValid,      // the position of the newest message is not valid
    kNoReading,     // no valid reading yet, or none since the publisher restarted
    kLimitUnknown,  // no max_age was given, and no DEVICE message came
    kWrongClock,  // the newest reading lay in the future when it arrived: the caller's time is not CLOCK_MONOTONIC
    kOtherClock,  // the publisher runs on another host, and there is no Options::time
    kTimeUnknown,  // the publisher runs on another host, and the instant of its newest reading is not known well enough
    kTwoPublishers,  // two drivers publish this device, or two machines have a device of this name
  };

  enum class Answer {
    kRead,           // a reading of just that instant
    kInterpolated,   // between two readings
    kExtrapolated,   // after the newest, at its speed
    kNoReading,      // nothing received yet
    kBeforeHistory,  // older than what is kept (kHistory messages, none from before a restart)
    kTooFarAhead,    // beyond max_extrapolation_ns
    kStale,          // as in Freshness
    kLimitUnknown,   // as in Freshness: without a maximum age nothing is extrapolated
    kNotValid,       // a reading it would rest on is not valid
    kDatumChanged,   // the datum, or the trust in the turns, changed between the two readings
    kGap,            // the two readings are further apart than max_gap_ns
    kSpeedUnknown,   // nothing to extrapolate with
    kWrongClock,     // as in Freshness
    kOtherClock,     // as in Freshness
    kTimeUnknown,    // as in Freshness
    kTwoPublishers,  // as in Freshness
  };

  // The position at an instant. It never rests on a reading older than the maximum age. Only where it converts to true do the
  // numbers mean anything; else they are NaN, and `answer` states why (ReasonText).
  struct Position {
    Answer answer = Answer::kNoReading;
    double counts = std::numeric_limits<double>::quiet_NaN();  // absolute, after direction and datum
    double value = std::numeric_limits<double>::quiet_NaN();  // in unit; NaN before the DEVICE message of this boot
    double timing_error_counts = std::numeric_limits<double>::quiet_NaN();  // by the readings' time uncertainty
    std::int32_t flags = 0;  // position_t FLAG_* that both readings have
    std::int32_t datum_epoch = 0;

    explicit operator bool() const {
      return answer == Answer::kRead || answer == Answer::kInterpolated || answer == Answer::kExtrapolated;
    }
  };

  // What one message changed.
  struct News {
    bool used = false;  // false: it came late, twice, out of its time's order, or from another machine or clock
    bool restarted = false;      // another boot_id: counts of before and after do not belong together
    bool datum_changed = false;  // datum_epoch differs from the message before
    std::int64_t lost = 0;       // messages between it and the one before
  };

  struct Totals {
    std::int64_t received = 0;
    std::int64_t lost = 0;  // by gaps in seq
    std::int64_t late = 0;  // came after a newer one; they were counted as lost, and are not used
    std::int64_t restarts = 0;
    std::int64_t datum_changes = 0;
    std::int64_t missed_readings = 0;  // as the driver counts them: readings that failed or were withheld
    // An earlier boot_id came back, or another machine: two drivers publish this device name.
    bool two_publishers = false;
    std::int64_t other_machine = 0;  // messages ignored because they state another machine than Options::machine_id
  };

  PositionTracker() = default;
  explicit PositionTracker(const Options& options) : options_(options) {}

  News OnPosition(const position_t& message, std::int64_t received_ns);
  void OnDevice(const device_info_t& message);

  [[nodiscard]] Freshness Check(std::int64_t now_ns) const;
  // Returns the time since the newest valid reading; negative without a valid reading.
  [[nodiscard]] std::int64_t AgeNs(std::int64_t now_ns) const { return valid_any_ ? now_ns - valid_at_ : -1; }
  // Returns the position at an instant. After the newest reading, it answers only where Check(instant_ns) returns kFresh.
  [[nodiscard]] Position At(std::int64_t instant_ns) const;
  // Returns the newest reading, at its own instant NewestInstantNs(), if it is fresh at `now_ns`.
  [[nodiscard]] Position Newest(std::int64_t now_ns) const;
  // The instant of the newest reading that is used, on the clock of the caller; 0 before the first.
  [[nodiscard]] std::int64_t NewestInstantNs() const { return size_ > 0 ? Back(0).at : 0; }
  [[nodiscard]] const Totals& totals() const { return totals_; }
  // The newest message; meaningless before the first.
  [[nodiscard]] const position_t& newest() const { return newest_; }

  // Messages between two sequence numbers. A wild number, which anybody on the network can send, is a loss of 2^31 and not an
  // overflow.
  [[nodiscard]] static std::int64_t LostBetween(std::int64_t seq, std::int64_t later);

  static constexpr std::size_t kHistory = 64;  // messages
  // Without messages of one of two publishers for this time, the other one is used again.
  static constexpr std::int64_t kAloneAfterNs = 3'000'000'000;

 private:
  static constexpr std::int64_t kFutureNs = 1'000'000;  // of a reading that counts as lying in the future

  struct Reading {
    std::int64_t at = 0;
    std::int64_t half_width = 0;
    std::int64_t counts = 0;
    double counts_per_ns = 0;  // where FLAG_SPEED_VALID
    std::int32_t flags = 0;
    std::int32_t epoch = 0;
  };

  // Returns the instant of the reading on the clock of the caller, and by how much that is uncertain; false if it is not known.
  bool Locate(const position_t& message, std::int64_t received_ns, std::int64_t& at, std::int64_t& half_width);
  // Another publisher than that of the newest message.
  void Replace(const position_t& message, std::int64_t received_ns);
  [[nodiscard]] const Reading& Back(std::size_t i) const { return ring_[(newest_at_ + kHistory - i) % kHistory]; }
  [[nodiscard]] static bool Valid(const Reading& reading) { return (reading.flags & position_t::FLAG_VALID) != 0; }
  [[nodiscard]] static Reading Take(const position_t& message, std::int64_t at, std::int64_t half_width);
  [[nodiscard]] static std::int64_t PeriodNs(const device_info_t& message);
  [[nodiscard]] static double Slope(const Reading& a, const Reading& b);
  [[nodiscard]] static Answer Joined(const Reading& a, const Reading& b, std::int64_t max_gap_ns);
  [[nodiscard]] Position Refuse(Answer answer) const;
  [[nodiscard]] Position Make(Answer answer, const Reading& base, std::int32_t flags, double ahead_ns,
                              double counts_per_ns, std::int64_t half_width) const;
  [[nodiscard]] Position Extrapolate(std::int64_t instant_ns) const;
  [[nodiscard]] double Value(double counts) const;
  [[nodiscard]] bool OnOtherClock() const;
  [[nodiscard]] std::int64_t MaxAgeNs() const {
    return options_.max_age_ns > 0 ? options_.max_age_ns : device_max_age_ns_;
  }
  [[nodiscard]] std::int64_t MaxExtrapolationNs() const;
  [[nodiscard]] std::int64_t MaxGapNs() const;

  Options options_;
  Totals totals_;
  position_t newest_{};
  bool any_ = false;
  std::int64_t previous_boot_ = 0;
  bool contested_ = false;         // two publishers
  std::int64_t contested_at_ = 0;  // arrival of the newest message that showed it
  bool wrong_clock_ = false;       // the newest reading lay in the future when it arrived
  bool located_ = true;            // the instant of the newest message is known
  std::uint64_t era_ = 0;          // of the readings that are kept: TimeBase::Instant
  bool valid_any_ = false;
  std::int64_t valid_at_ = 0;
  std::int64_t valid_half_width_ = 0;
  std::array<Reading, kHistory> ring_{};
  std::size_t newest_at_ = 0;
  std::size_t size_ = 0;

  bool has_device_ = false;
  std::int64_t device_boot_ = 0;
  std::int64_t device_max_age_ns_ = 0;
  std::int64_t device_period_ns_ = 0;
  double unit_per_count_ = 0;
  double modulo_ = 0;
};

// A restarted driver has a new boot_id and the same machine. It never returns to the earlier boot_id.
inline void PositionTracker::Replace(const position_t& message, std::int64_t received_ns) {
  if (message.boot_id == previous_boot_ || message.machine_id != newest_.machine_id) {
    totals_.two_publishers = true;
    contested_ = true;
    contested_at_ = received_ns;
  }
  totals_.restarts += contested_ ? 0 : 1;
  previous_boot_ = newest_.boot_id;
  size_ = 0;
  valid_any_ = false;
}

inline bool PositionTracker::OnOtherClock() const {
  return options_.instant == Options::Instant::kSampled &&
         (newest_.clock_id == 0 || newest_.clock_id != options_.clock_id);
}

inline bool PositionTracker::Locate(const position_t& message, std::int64_t received_ns, std::int64_t& at,
                                    std::int64_t& half_width) {
  half_width = message.time_uncertainty_ns;
  at = options_.instant == Options::Instant::kSampled ? message.mono_ns : received_ns;
  if (!OnOtherClock()) return at >= 0;
  if (options_.time == nullptr || message.clock_id == 0) return false;
  const TimeBase::Instant here =
      options_.time->OnClock(options_.clock_id, message.clock_id, message.mono_ns, received_ns);
  if (!here || here.half_width_ns + half_width > options_.max_time_half_width_ns) return false;
  if (here.era != era_) {  // instants of before and after are not comparable
    size_ = 0;
    valid_any_ = false;
  }
  era_ = here.era;
  at = here.ns;
  half_width += here.half_width_ns;
  return at >= 0;
}

inline std::int64_t PositionTracker::MaxExtrapolationNs() const {
  constexpr std::int64_t kLeast = 5'000'000;
  if (options_.max_extrapolation_ns >= 0) return options_.max_extrapolation_ns;
  return 2 * device_period_ns_ > kLeast ? 2 * device_period_ns_ : kLeast;
}

inline std::int64_t PositionTracker::MaxGapNs() const {
  constexpr std::int64_t kLeast = 50'000'000;
  if (options_.max_gap_ns >= 0) return options_.max_gap_ns;
  return 3 * device_period_ns_ > kLeast ? 3 * device_period_ns_ : kLeast;
}

inline PositionTracker::Reading PositionTracker::Take(const position_t& message, std::int64_t at,
                                                      std::int64_t half_width) {
  constexpr double kTwoPi = 6.283185307179586;
  Reading reading;
  reading.at = at;
  reading.half_width = half_width;
  reading.counts = message.counts;
  reading.counts_per_ns = message.speed_rad_s / kTwoPi * static_cast<double>(message.counts_per_turn) * 1e-9;
  reading.flags = message.flags;
  reading.epoch = message.datum_epoch;
  return reading;
}

inline std::int64_t PositionTracker::LostBetween(std::int64_t seq, std::int64_t later) {
  constexpr std::uint64_t kMax = std::uint64_t{1} << 31;
  const std::uint64_t lost = static_cast<std::uint64_t>(later) - static_cast<std::uint64_t>(seq) - 1;
  return static_cast<std::int64_t>(lost < kMax ? lost : kMax);
}

inline PositionTracker::News PositionTracker::OnPosition(const position_t& message, std::int64_t received_ns) {
  News news;
  if (options_.machine_id != 0 && message.machine_id != 0 && message.machine_id != options_.machine_id) {
    ++totals_.other_machine;
    return news;
  }
  ++totals_.received;
  if (contested_ && received_ns - contested_at_ > kAloneAfterNs) contested_ = false;
  if (any_ && (message.boot_id != newest_.boot_id || message.machine_id != newest_.machine_id)) {
    Replace(message, received_ns);
    news.restarted = !contested_;
  } else if (any_ && message.seq <= newest_.seq) {
    ++totals_.late;
    return news;
  } else if (any_) {
    news.lost = LostBetween(newest_.seq, message.seq);
    totals_.lost += news.lost;
    news.datum_changed = message.datum_epoch != newest_.datum_epoch;
    totals_.datum_changes += news.datum_changed ? 1 : 0;
  }
  any_ = true;
  newest_ = message;
  totals_.missed_readings += message.missed;
  std::int64_t at = 0;
  std::int64_t half_width = 0;
  const bool located = Locate(message, received_ns, at, half_width);
  located_ = located || !OnOtherClock();
  wrong_clock_ = located && at - half_width > received_ns + kFutureNs;
  if (!located || (size_ > 0 && at <= Back(0).at)) return news;
  news.used = true;
  newest_at_ = (newest_at_ + 1) % kHistory;
  size_ = size_ < kHistory ? size_ + 1 : kHistory;
  ring_[newest_at_] = Take(message, at, half_width);
  if (Valid(ring_[newest_at_])) {
    valid_any_ = true;
    valid_at_ = at;
    valid_half_width_ = OnOtherClock() ? half_width : 0;
  }
  return news;
}

// Returns why there is no position, for people.
inline const char* ReasonText(PositionTracker::Freshness freshness) {
  switch (freshness) {
    case PositionTracker::Freshness::kFresh:
      return "the position is fresh";
    case PositionTracker::Freshness::kStale:
      return "the newest valid reading is too old";
    case PositionTracker::Freshness::kNotValid:
      return "the driver marks the newest reading as not valid";
    case PositionTracker::Freshness::kNoReading:
      return "no valid reading has arrived yet: does the driver run?";
    case PositionTracker::Freshness::kLimitUnknown:
      return "no DEVICE message has arrived yet, which states the maximum age";
    case PositionTracker::Freshness::kWrongClock:
      return "the reading lies in the future: give CLOCK_MONOTONIC of this host";
    case PositionTracker::Freshness::kOtherClock:
      return "the driver runs on another host: give Options::time, and the TIME messages to it";
    case PositionTracker::Freshness::kTimeUnknown:
      return "the driver runs on another host, and the instants of its readings are not known well enough: see "
             "`axlecast status`";
    case PositionTracker::Freshness::kTwoPublishers:
      return "two drivers publish this device, or two machines have a device of this name";
  }
  return "unknown";
}

inline const char* ReasonText(PositionTracker::Answer answer) {
  switch (answer) {
    case PositionTracker::Answer::kRead:
    case PositionTracker::Answer::kInterpolated:
    case PositionTracker::Answer::kExtrapolated:
      return "the position is known";
    case PositionTracker::Answer::kNoReading:
      return "no reading has arrived yet: does the driver run?";
    case PositionTracker::Answer::kBeforeHistory:
      return "the instant is older than the readings that are kept";
    case PositionTracker::Answer::kTooFarAhead:
      return "the instant is too long after the newest reading";
    case PositionTracker::Answer::kStale:
      return ReasonText(PositionTracker::Freshness::kStale);
    case PositionTracker::Answer::kLimitUnknown:
      return ReasonText(PositionTracker::Freshness::kLimitUnknown);
    case PositionTracker::Answer::kNotValid:
      return "a reading at this instant is not valid";
    case PositionTracker::Answer::kDatumChanged:
      return "the datum changed between the two readings";
    case PositionTracker::Answer::kGap:
      return "the two readings are too far apart";
    case PositionTracker::Answer::kSpeedUnknown:
      return "the speed after the newest reading is not known yet";
    case PositionTracker::Answer::kWrongClock:
      return ReasonText(PositionTracker::Freshness::kWrongClock);
    case PositionTracker::Answer::kOtherClock:
      return ReasonText(PositionTracker::Freshness::kOtherClock);
    case PositionTracker::Answer::kTimeUnknown:
      return ReasonText(PositionTracker::Freshness::kTimeUnknown);
    case PositionTracker::Answer::kTwoPublishers:
      return ReasonText(PositionTracker::Freshness::kTwoPublishers);
  }
  return "unknown";
}

// A device that sends by itself, or is read as fast as the bus allows, states no period. Its maximum age is three periods, or more.
inline std::int64_t PositionTracker::PeriodNs(const device_info_t& message) {
  const std::int32_t readings = message.poll_us > 0 ? message.poll_us : message.max_age_us / 3;
  return std::int64_t{readings > message.publish_us ? readings : message.publish_us} * 1'000;
}

inline void PositionTracker::OnDevice(const device_info_t& message) {
  if (options_.machine_id != 0 && message.machine_id != 0 && message.machine_id != options_.machine_id) return;
  has_device_ = message.ratio_den != 0 && message.counts_per_turn > 0;
  device_boot_ = message.boot_id;
  device_max_age_ns_ = std::int64_t{message.max_age_us} * 1'000;
  device_period_ns_ = PeriodNs(message);
  modulo_ = message.modulo;
  unit_per_count_ = has_device_
                        ? message.per_turn * static_cast<double>(message.ratio_num) /
                              static_cast<double>(message.ratio_den) / static_cast<double>(message.counts_per_turn)
                        : 0;
}

inline PositionTracker::Freshness PositionTracker::Check(std::int64_t now_ns) const {
  if (contested_) return Freshness::kTwoPublishers;
  if (any_ && OnOtherClock() && options_.time == nullptr) return Freshness::kOtherClock;
  if (any_ && !located_) return Freshness::kTimeUnknown;
  if (wrong_clock_) return Freshness::kWrongClock;
  if (!valid_any_) return Freshness::kNoReading;
  const std::int64_t max_age = MaxAgeNs();
  if (max_age <= 0) return Freshness::kLimitUnknown;
  const std::int64_t age = AgeNs(now_ns);
  if (age < -kFutureNs - valid_half_width_) return Freshness::kWrongClock;
  if (age + valid_half_width_ > max_age) return Freshness::kStale;
  return Valid(Back(0)) ? Freshness::kFresh : Freshness::kNotValid;
}

inline PositionTracker::Position PositionTracker::Refuse(Answer answer) const {
  Position position;
  position.answer = answer;
  position.datum_epoch = newest_.datum_epoch;
  return position;
}

inline double PositionTracker::Value(double counts) const {
  if (!has_device_ || device_boot_ != newest_.boot_id) return std::numeric_limits<double>::quiet_NaN();
  const double value = counts * unit_per_count_;
  if (!(modulo_ > 0)) return value;
  const double wrapped = std::fmod(value, modulo_);
  const double positive = wrapped < 0 ? wrapped + modulo_ : wrapped;
  return positive >= modulo_ ? 0 : positive;
}

inline PositionTracker::Position PositionTracker::Make(Answer answer, const Reading& base, std::int32_t flags,
                                                       double ahead_ns, double counts_per_ns,
                                                       std::int64_t half_width) const {
  Position position;
  position.answer = answer;
  position.counts = static_cast<double>(base.counts) + counts_per_ns * ahead_ns;
  position.value = Value(position.counts);
  position.timing_error_counts = std::abs(counts_per_ns) * static_cast<double>(half_width);
  position.flags = flags;
  position.datum_epoch = base.epoch;
  return position;
}

inline double PositionTracker::Slope(const Reading& a, const Reading& b) {
  return (static_cast<double>(b.counts) - static_cast<double>(a.counts)) / static_cast<double>(b.at - a.at);
}

// Whether a straight line joins the two; kInterpolated when it does.
inline PositionTracker::Answer PositionTracker::Joined(const Reading& a, const Reading& b,
                                                       std::int64_t max_gap_ns) {
  if (!Valid(a) || !Valid(b)) return Answer::kNotValid;
  if (a.epoch != b.epoch || ((a.flags ^ b.flags) & position_t::FLAG_TURNS_VALID) != 0) return Answer::kDatumChanged;
  return b.at - a.at > max_gap_ns ? Answer::kGap : Answer::kInterpolated;
}

inline PositionTracker::Position PositionTracker::Extrapolate(std::int64_t instant_ns) const {
  const Reading& last = Back(0);
  if (!Valid(last)) return Refuse(Answer::kNotValid);
  if (MaxAgeNs() <= 0) return Refuse(Answer::kLimitUnknown);
  if (instant_ns - last.at + valid_half_width_ > MaxAgeNs()) return Refuse(Answer::kStale);
  if (instant_ns - last.at > MaxExtrapolationNs()) return Refuse(Answer::kTooFarAhead);
  double counts_per_ns = 0;
  if ((last.flags & position_t::FLAG_SPEED_VALID) != 0) {
    counts_per_ns = last.counts_per_ns;
  } else if (size_ > 1 && Joined(Back(1), last, MaxGapNs()) == Answer::kInterpolated) {
    counts_per_ns = Slope(Back(1), last);
  } else {
    return Refuse(Answer::kSpeedUnknown);
  }
  return Make(Answer::kExtrapolated, last, last.flags, static_cast<double>(instant_ns - last.at), counts_per_ns,
              last.half_width);
}

inline PositionTracker::Position PositionTracker::At(std::int64_t instant_ns) const {
  if (contested_) return Refuse(Answer::kTwoPublishers);
  if (any_ && OnOtherClock() && options_.time == nullptr) return Refuse(Answer::kOtherClock);
  if (any_ && !located_) return Refuse(Answer::kTimeUnknown);
  if (wrong_clock_) return Refuse(Answer::kWrongClock);
  if (size_ == 0) return Refuse(Answer::kNoReading);
  if (instant_ns > Back(0).at) return Extrapolate(instant_ns);
  for (std::size_t i = 0; i < size_; ++i) {
    const Reading& before = Back(i);
    if (before.at > instant_ns) continue;
    if (before.at == instant_ns) {
      return Valid(before) ? Make(Answer::kRead, before, before.flags, 0, 0, 0) : Refuse(Answer::kNotValid);
    }
    const Reading& after = Back(i - 1);
    const Answer joined = Joined(before, after, MaxGapNs());
    if (joined != Answer::kInterpolated) return Refuse(joined);
    return Make(joined, before, before.flags & after.flags, static_cast<double>(instant_ns - before.at),
                Slope(before, after), before.half_width > after.half_width ? before.half_width : after.half_width);
  }
  return Refuse(Answer::kBeforeHistory);
}

inline PositionTracker::Position PositionTracker::Newest(std::int64_t now_ns) const {
  switch (Check(now_ns)) {
    case Freshness::kFresh:
      return Make(Answer::kRead, Back(0), Back(0).flags, 0, 0, 0);
    case Freshness::kStale:
      return Refuse(Answer::kStale);
    case Freshness::kNotValid:
      return Refuse(Answer::kNotValid);
    case Freshness::kNoReading:
      return Refuse(Answer::kNoReading);
    case Freshness::kLimitUnknown:
      return Refuse(Answer::kLimitUnknown);
    case Freshness::kWrongClock:
      return Refuse(Answer::kWrongClock);
    case Freshness::kOtherClock:
      return Refuse(Answer::kOtherClock);
    case Freshness::kTimeUnknown:
      return Refuse(Answer::kTimeUnknown);
    case Freshness::kTwoPublishers:
      return Refuse(Answer::kTwoPublishers);
  }
  return Refuse(Answer::kNoReading);
}

}  // namespace axlecast
