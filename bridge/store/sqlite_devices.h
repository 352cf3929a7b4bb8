#pragma once

#include <cstddef>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "bridge/store/database.h"
#include "bridge/store/durable_store.h"

namespace axlecast {

// The devices of SqliteStore: the tables `axes`, `datums`, `alarm_marks` and `events`, and what waits to be written there.
class SqliteAxes {
 public:
  // Events that could not be written yet; then the oldest is forgotten.
  static constexpr std::size_t kMaxEvents = 1'000;
  // A shaft that stands still is written so seldom: flash wears.
  static constexpr std::int64_t kStandingUs = 60'000'000;

  // `database` may be null.
  [[nodiscard]] AxisRecord Find(Database* database, const std::string& device) const;
  [[nodiscard]] static std::vector<DatumRecord> Datums(Database& database, const std::string& device);
  [[nodiscard]] static std::vector<AlarmMark> Marks(Database& database, const std::string& device);

  // In a transaction.
  [[nodiscard]] static bool Apply(Database& database, const std::string& device, const DeviceChange& change);

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
