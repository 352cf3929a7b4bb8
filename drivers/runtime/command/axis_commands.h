#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/device/operation.h"
#include "drivers/runtime/axis/device_publisher.h"

namespace axlecast {

// A command about an alarm, which needs no device: acknowledge_alarm, shelve_alarm, unshelve_alarm or
// restore_acknowledgement (IsAboutAlarms).
class AlarmCommand {
 public:
  // How long a restarted driver waits for an alarm that was present and acknowledged before. An encoder without battery
  // answers 1.5 s after power-on, and a silent encoder is OFFLINE only 2 s later.
  static constexpr std::int64_t kExpectedUs = 10'000'000;

  // Checks the command against the alarms of the device. `unix_us`: now. The error has a REASON_*.
  [[nodiscard]] static Result<AlarmCommand> Make(const DevicePublisher& publisher, const DriverCommand& command,
                                                 std::int64_t unix_us);

  // Returns what Apply would do.
  [[nodiscard]] Outcome Prepared() const;
  [[nodiscard]] Outcome Apply(DevicePublisher& publisher) const;

 private:
  enum class Kind : std::uint8_t { kAcknowledge, kShelve, kUnshelve, kExpect };

  AlarmCommand(const DevicePublisher& publisher, const DriverCommand& command, std::int64_t unix_us);

  [[nodiscard]] static Kind KindOf(std::string_view operation);
  [[nodiscard]] Result<> Check(const AlarmTable& alarms, const DriverCommand& command);
  [[nodiscard]] Result<> CheckAcknowledge(const AlarmTable& alarms) const;
  [[nodiscard]] Result<> CheckShelve(const AlarmTable& alarms, const DriverCommand& command);
  [[nodiscard]] Result<> ReadTime(const DriverCommand& command);
  [[nodiscard]] Result<> ReadSeverity(const AlarmTable& alarms, const DriverCommand& command);
  [[nodiscard]] std::vector<Change> Changes() const;
  // Returns "battery_error is acknowledged", or "would be" if not `done`.
  [[nodiscard]] std::string Text(bool done) const;

  Kind kind_;
  std::string alarm_;
  std::int64_t unix_us_;
  AlarmTable::Standing standing_;
  AlarmShelves::Shelf shelf_;
};

// A command about the datum of an axis, which needs no device: set_datum, clear_datum or mark_reference_lost.
class DatumCommand {
 public:
  // Checks the command against the axis. `unix_us`: now. The error has a REASON_*.
  [[nodiscard]] static Result<DatumCommand> Make(const DevicePublisher& publisher, const DriverCommand& command,
                                                 std::int64_t unix_us);

  // Returns what Apply would do.
  [[nodiscard]] Outcome Prepared() const;
  [[nodiscard]] Outcome Apply(DevicePublisher& publisher) const;

 private:
  enum class Kind : std::uint8_t { kSet, kClear, kMarkLost };

  explicit DatumCommand(const DevicePublisher& publisher);

  [[nodiscard]] Result<> CheckSet(const DevicePublisher& publisher, const DriverCommand& command,
                                  std::int64_t unix_us);
  [[nodiscard]] Result<> CheckClear() const;
  [[nodiscard]] Result<> CheckIdentity(const std::string& expected) const;
  [[nodiscard]] Result<> ReadCounts(const DevicePublisher& publisher, const std::string& key,
                                    const std::string& text);
  [[nodiscard]] std::vector<Change> Changes(std::string value_after) const;
  [[nodiscard]] std::optional<Reference::Datum> DatumAfter() const;

  Kind kind_ = Kind::kMarkLost;
  Reference::Datum datum_;  // to be set
  bool dated_ = false;      // established at another time than now
  double value_before_;
  std::optional<double> value_after_;
  std::optional<Reference::Datum> datum_before_;
  std::optional<Reference::Datum> file_datum_;
  std::string identity_;
};

// Returns a number in the unit of the axis as text; empty if it is unknown (NaN).
[[nodiscard]] std::string ValueText(double value);

}  // namespace axlecast
