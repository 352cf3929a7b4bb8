#pragma once

#include <cstddef>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "bridge/store/database.h"
#include "bridge/store/durable_store.h"

namespace axlecast {

// Write and read the table `alarm_marks`. Functions that return bool must run in a transaction of the caller.
[[nodiscard]] bool SetAlarmMark(Database& database, const std::string& device, const AlarmMark& mark);
[[nodiscard]] bool EndAlarmMark(Database& database, const std::string& device, AlarmMark::Kind kind,
                                const std::string& alarm);
[[nodiscard]] std::vector<AlarmMark> AlarmMarksOf(Database& database, const std::string& device);

// The devices of SqliteStore: the tables `axes`, `datums` and `events`, and what waits to be written there.
// What takes a Database& and answers bool belongs into a transaction.
class SqliteAxes {
 public:
  // Events that could not be written yet; then the oldest is forgotten.
  static constexpr std::size_t kMaxEvents = 1'000;
  // A shaft that stands still is written so seldom: flash wears.
  static constexpr std::int64_t kStandingUs = 60'000'000;

  // `database` may be null.
  [[nodiscard]] AxisRecord Find(Database* database, const std::string& device) const;
  [[nodiscard]] static std::vector<DatumRecord> Datums(Database& database, const std::string& device);

  [[nodiscard]] static bool SetDatum(Database& database, const std::string& device, const DatumRecord& datum);
  [[nodiscard]] static bool VoidDatum(Database& database, const std::string& device, std::int64_t utime,
                                      const std::string& why);
  [[nodiscard]] static bool AddWrites(Database& database, const std::string& device, std::int64_t writes,
                                      std::int64_t utime);
  [[nodiscard]] static bool SetReferenceLost(Database& database, const std::string& device, bool lost);
  [[nodiscard]] static bool SetIdentity(Database& database, const std::string& device, const std::string& identity);
  [[nodiscard]] static bool Exchange(Database& database, const std::string& device, const std::string& identity,
                                     std::int64_t utime);

  void Keep(const std::string& device, const LastPosition& position) { positions_[device] = position; }
  // After an exchange was committed.
  void Forget(const std::string& device);
  void Note(const AxisEvent& event);

  // Positions that are worth writing; all: even of shafts that stand still.
  enum class Positions : std::uint8_t { kNone, kMoved, kAll };
  // In a transaction: the events, and these positions. Written() follows when it was committed.
  [[nodiscard]] bool WriteWaiting(Database& database, Positions which);
  void Written();
  [[nodiscard]] bool events_wait() const { return !events_.empty(); }
  [[nodiscard]] bool positions_wait() const;

 private:
  [[nodiscard]] bool IsWorthWriting(const std::string& device, const LastPosition& position) const;

  std::map<std::string, LastPosition> positions_;  // not written
  std::map<std::string, LastPosition> written_;    // last
  std::vector<std::string> batch_;                 // of positions_, being written
  std::deque<AxisEvent> events_;
};

}  // namespace axlecast
