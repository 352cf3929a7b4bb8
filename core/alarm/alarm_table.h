#pragma once

#include <axlecast/alarm_t.hpp>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/spelling.h"
#include "core/base/time.h"
#include "core/device/device.h"
#include "core/messages/origin.h"

namespace axlecast {

// Alarms of one device that an operator has put aside for a time. By name: a shelf may wait for its alarm.
class AlarmShelves {
 public:
  static constexpr std::int64_t kLongestUs = 24 * INT64_C(3'600'000'000);
  static constexpr std::size_t kMax = 32;  // of one device

  struct Shelf {
    std::string alarm;
    std::int64_t until_utime = 0;  // us, UNIX time
    std::uint8_t up_to = 0;        // alarm_entry_t SEVERITY_*: a worse one is not put aside
  };

  [[nodiscard]] const Shelf* Find(std::string_view alarm) const;
  [[nodiscard]] bool IsFull() const { return shelves_.size() >= kMax; }
  // Returns why a full table accepts no further alarm, and what to do.
  [[nodiscard]] static std::string FullText() {
    return std::to_string(kMax) + " alarms of this device are shelved: unshelve some first";
  }
  // In the place of the one that there is.
  void Put(Shelf shelf);
  // False when there was none.
  bool Remove(std::string_view alarm);
  // True when the time of any is over: they are gone. However the clock was set, none lasts longer than kLongestUs.
  bool Expire(std::int64_t utime);

  [[nodiscard]] bool Hides(const AlarmSpec& alarm) const;

 private:
  std::vector<Shelf> shelves_;
};

// The alarms of one device, with their acknowledgements and shelves. A repeated report of the same state allocates nothing
// and does not change the revision.
class AlarmTable {
 public:
  // An alarm of `stays_from` or worse (alarm_entry_t SEVERITY_*) that went without being acknowledged stays listed.
  explicit AlarmTable(std::uint8_t stays_from = kNoSeverity) : stays_from_(stays_from) {
    entries_.reserve(kExpected);
  }

  // `detail`: replaces the action of the alarm, <= 80 bytes; empty: the action is that of `alarm`.
  void Set(const AlarmSpec& alarm, AlarmState state, std::int64_t utime, std::string_view detail = {});
  // While the device is offline, the state of its own alarms is UNKNOWN, and none is cleared. A later report of the device
  // counts again. When the device is online again, its other alarms have their last reported state.
  void SetOffline(bool offline);

  // The state of an alarm by its name.
  struct Standing {
    bool known = false;  // there was one since the driver started
    bool present = false;
    bool gone = false;  // and nobody has acknowledged it
    bool acknowledged = false;
    std::uint8_t severity = 0;
  };
  [[nodiscard]] Standing Look(std::string_view name) const;
  // Somebody has seen it: one that has gone is listed no more; one that is present will not stay when it goes. Nothing
  // else changes, and when it comes again or gets worse, it counts as new.
  void Acknowledge(std::string_view name);
  // The same for an alarm that a driver before this one has seen acknowledged: should it be here, or come until
  // `until_utime`, it is the same one.
  void AcknowledgeAgain(std::string_view name, std::int64_t until_utime);
  // Names of those that are present and acknowledged, or may be yet; and how often that has changed.
  [[nodiscard]] std::vector<std::string> Acknowledged() const;
  [[nodiscard]] std::int64_t acknowledged_revision() const { return acknowledged_revision_; }

  // Shelves an alarm: it is listed last as SHELVED, and does not stay listed when it clears.
  void Shelve(AlarmShelves::Shelf shelf);
  void Unshelve(std::string_view name);
  [[nodiscard]] const AlarmShelves& shelves() const { return shelves_; }

  // Ends shelves whose time is over.
  void Tick(std::int64_t utime);

  // The names of those that are listed, for people.
  [[nodiscard]] std::string Names() const;
  [[nodiscard]] std::int64_t revision() const { return revision_; }
  // Returns the most severe present alarm of at least `severity`; null if no alarm qualifies.
  [[nodiscard]] const AlarmSpec* Worst(std::uint8_t severity) const;

  // Fills in revision, total, n and entries: worst first, then the newest. Always of the same message: strings are
  // written only where the revision has changed.
  void Write(alarm_t& message, std::int64_t utime);

 private:
  struct Entry {
    AlarmSpec spec;
    AlarmState state = AlarmState::kAbsent;
    bool unknown = false;
    bool gone = false;  // unacknowledged
    bool acknowledged = false;
    std::int64_t first_utime = 0;
    std::int64_t last_utime = 0;
    std::int32_t count = 0;
    std::string detail = {};
  };
  struct Expected {
    std::string alarm;
    std::int64_t until_utime;
  };
  [[nodiscard]] static bool IsListed(const Entry& entry) {
    return entry.state != AlarmState::kAbsent || entry.gone;
  }
  [[nodiscard]] Entry* Find(const AlarmSpec& alarm);
  void Appear(Entry& entry, std::int64_t utime);
  void Vanish(Entry& entry);
  void Regrade(Entry& entry, const AlarmSpec& alarm);
  void SetAcknowledged(Entry& entry, bool acknowledged);
  [[nodiscard]] bool TakeExpected(std::string_view name, std::int64_t utime);
  void Arrange(alarm_t& message);
  [[nodiscard]] std::int8_t StateCode(const Entry& entry) const;
  // What is present, then what has gone, then what is put aside.
  [[nodiscard]] int Rank(const Entry& entry) const;
  [[nodiscard]] static bool Worse(const Entry* a, const Entry* b);

  static constexpr std::size_t kExpected = 32;

  const std::uint8_t stays_from_;
  std::vector<Entry> entries_;      // every alarm ever seen
  std::vector<Expected> expected_;  // acknowledged before this driver started
  AlarmShelves shelves_;
  std::vector<const Entry*> shown_;  // those of the last message; hold as long as the revision does
  std::int64_t shown_revision_ = 0;
  bool offline_ = false;
  std::int64_t revision_ = 0;
  std::int64_t acknowledged_revision_ = 0;
};

// The alarms of one program other than a driver, and its ALARM message.
class ProgramAlarms {
 public:
  ProgramAlarms(std::string name, const Origin& origin);

  // With `latched`, an alarm that is not present is listed as DRIVER_LATCHED. `utime`: us, UNIX time. `detail` as in AlarmTable.
  void Set(const AlarmSpec& alarm, bool present, std::int64_t utime, bool latched = false,
           std::string_view detail = {});
  // Returns the message for `now`; valid until the next call.
  [[nodiscard]] const alarm_t& Make(Timestamp now);
  [[nodiscard]] std::int64_t revision() const { return table_.revision(); }

 private:
  AlarmTable table_;
  alarm_t message_{};
};

}  // namespace axlecast
