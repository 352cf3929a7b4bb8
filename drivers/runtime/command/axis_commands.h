#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/device/operation.h"
#include "drivers/runtime/axis/device_publisher.h"

namespace axlecast {

// An order about an alarm, which needs no device: acknowledge_alarm, shelve_alarm, unshelve_alarm or
// restore_acknowledgement (IsAboutAlarms), judged against the alarms of its channel.
class AlarmOrder {
 public:
  // How long a restarted driver waits for an alarm that was present and acknowledged before. An encoder without battery
  // answers 1.5 s after power-on, and only 2 s later is a silent one called offline.
  static constexpr std::int64_t kExpectedUs = 10'000'000;

  // `utime`: now, us.
  AlarmOrder(const DevicePublisher& channel, const DriverCommand& order, std::int64_t utime);

  // Why it cannot be done; nothing when it can.
  [[nodiscard]] const std::optional<Outcome>& refusal() const { return refusal_; }
  // What it would do. Only without a refusal, like Apply.
  [[nodiscard]] Outcome Prepared() const;
  [[nodiscard]] Outcome Apply(DevicePublisher& channel) const;

 private:
  enum class Kind : std::uint8_t { kAcknowledge, kShelve, kUnshelve, kExpect };

  [[nodiscard]] static Kind KindOf(std::string_view operation);
  void Judge(const AlarmTable& alarms, const DriverCommand& order);
  void JudgeAcknowledge(const AlarmTable& alarms);
  void JudgeShelve(const AlarmTable& alarms, const DriverCommand& order);
  void JudgeTime(const DriverCommand& order);
  void JudgeSeverity(const AlarmTable& alarms, const DriverCommand& order);
  void Refuse(std::string text);
  [[nodiscard]] std::vector<Change> Changes() const;
  // "battery_error is acknowledged"; `done` or what would be.
  [[nodiscard]] std::string Text(bool done) const;

  Kind kind_;
  std::optional<Outcome> refusal_;
  std::string alarm_;
  std::int64_t utime_;
  AlarmTable::Standing standing_;
  AlarmShelves::Shelf shelf_;
};

// An order about the datum of an axis, which needs no device: set_datum, clear_datum or mark_reference_lost, judged
// against its channel.
class DatumOrder {
 public:
  // `utime`: now, us.
  DatumOrder(const DevicePublisher& channel, const DriverCommand& order, std::int64_t utime);

  // Why it cannot be done; nothing when it can.
  [[nodiscard]] const std::optional<Outcome>& refusal() const { return refusal_; }
  // What it would do. Only without a refusal, like Apply.
  [[nodiscard]] Outcome Prepared() const;
  [[nodiscard]] Outcome Apply(DevicePublisher& channel) const;

 private:
  enum class Kind : std::uint8_t { kSet, kClear, kMarkLost };

  void JudgeSet(const DevicePublisher& channel, const DriverCommand& order, std::int64_t utime);
  void JudgeClear();
  void JudgeIdentity(const std::string& wanted);
  void JudgeCounts(const DevicePublisher& channel, const std::string& key, const std::string& text);
  [[nodiscard]] std::vector<Change> Changes(std::string value_after) const;
  [[nodiscard]] std::optional<Reference::Datum> DatumAfter() const;
  void Refuse(std::int32_t reason, std::string text);

  Kind kind_ = Kind::kMarkLost;
  std::optional<Outcome> refusal_;
  Reference::Datum datum_;  // to be set
  bool dated_ = false;      // established at another time than now
  double value_before_;
  std::optional<double> value_after_;
  std::optional<Reference::Datum> datum_before_;
  std::optional<Reference::Datum> file_datum_;
  std::string identity_;
};

// A number of the device's unit as text; empty where it is unknown.
[[nodiscard]] std::string ValueText(double value);

}  // namespace axlecast
