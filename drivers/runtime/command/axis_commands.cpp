#include "drivers/runtime/command/axis_commands.h"

#include <axlecast/command_status_t.hpp>
#include <charconv>
#include <cmath>
#include <utility>

#include "core/base/spelling.h"
#include "core/base/text.h"
#include "core/command/commands.h"
#include "drivers/kit/arguments.h"

namespace axlecast {
namespace {

using Status = command_status_t;

constexpr std::int64_t kUsPerSecond = 1'000'000;

// Beyond this, a double cannot distinguish adjacent counts, and sums could exceed 64 bits.
constexpr double kLargestDatum = 9.0e15;

template <typename Number>
std::optional<Number> ParseDatum(std::string_view text) {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  if (!(std::abs(static_cast<double>(number)) <= kLargestDatum)) return std::nullopt;  // NaN, too
  return number;
}

std::string DatumText(const std::optional<Reference::Datum>& datum) {
  return datum ? std::to_string(datum->counts) : "none";
}

auto BadArgument(std::string text) { return Failure(std::move(text), Status::REASON_BAD_ARGUMENT); }

// A command about an alarm.
class AlarmCommand {
 public:
  // Checks the command against the alarms of the device.
  [[nodiscard]] static Result<AlarmCommand> Make(const DevicePublisher& publisher, const DriverCommand& command,
                                                 std::int64_t unix_us) {
    AlarmCommand made(publisher, command, unix_us);
    if (Result<> checked = made.Check(publisher.alarms(), command); !checked) return Failure(checked.error());
    return made;
  }

  [[nodiscard]] Outcome Prepared() const {
    return {.state = CommandState::kSucceeded, .text = Text(false), .changes = Changes()};
  }

  [[nodiscard]] Outcome Apply(DevicePublisher& publisher) const {
    AlarmTable& alarms = publisher.alarms();
    switch (kind_) {
      case Kind::kAcknowledge:
        alarms.Acknowledge(alarm_);
        break;
      case Kind::kShelve:
        alarms.Shelve(shelf_);
        break;
      case Kind::kUnshelve:
        alarms.Unshelve(alarm_);
        break;
      case Kind::kExpect:
        alarms.AcknowledgeAgain(alarm_, unix_us_ + kExpectedUs);
        break;
    }
    return {.state = CommandState::kSucceeded, .text = Text(true), .verified = true, .changes = Changes()};
  }

 private:
  enum class Kind : std::uint8_t { kAcknowledge, kShelve, kUnshelve, kExpect };

  // How long a restarted driver waits for an alarm that was present and acknowledged before. An encoder without battery
  // answers 1.5 s after power-on, and a silent encoder is OFFLINE only 2 s later.
  static constexpr std::int64_t kExpectedUs = 10'000'000;

  AlarmCommand(const DevicePublisher& publisher, const DriverCommand& command, std::int64_t unix_us)
      : kind_(KindOf(command.operation)),
        alarm_(FindArgument(command.arguments, "alarm").value_or("")),
        unix_us_(unix_us),
        standing_(publisher.alarms().Look(alarm_)) {}

  [[nodiscard]] static Kind KindOf(std::string_view operation) {
    if (operation == kAcknowledgeAlarm) return Kind::kAcknowledge;
    if (operation == kShelveAlarm) return Kind::kShelve;
    return operation == kUnshelveAlarm ? Kind::kUnshelve : Kind::kExpect;
  }

  [[nodiscard]] Result<> Check(const AlarmTable& alarms, const DriverCommand& command) {
    const bool is_word =
        alarm_.find_first_of(" *") == std::string::npos && alarm_ == CappedText(alarm_, kNameBytes);
    if (alarm_.empty() || !is_word) {
      return BadArgument("alarm is not a name: give one word of at most 24 bytes, as in ALARM");
    }
    if (kind_ == Kind::kAcknowledge) return CheckAcknowledge(alarms);
    if (kind_ == Kind::kShelve) return CheckShelve(alarms, command);
    if (kind_ == Kind::kUnshelve && alarms.shelves().Find(alarm_) == nullptr) {
      return BadArgument(alarm_ + " is not shelved: there is nothing to unshelve");
    }
    return {};
  }

  [[nodiscard]] Result<> CheckAcknowledge(const AlarmTable& alarms) const {
    if (standing_.present || standing_.gone) return {};
    const std::string names = alarms.Names();
    return BadArgument(alarm_ + " is not listed: there is nothing to acknowledge; " +
                       (names.empty() ? "there is no alarm" : "there are " + names));
  }

  [[nodiscard]] Result<> CheckShelve(const AlarmTable& alarms, const DriverCommand& command) {
    shelf_.alarm = alarm_;
    if (Result<> time = ReadTime(command); !time) return time;
    if (Result<> severity = ReadSeverity(alarms, command); !severity) return severity;
    if (!alarms.shelves().IsFull() || alarms.shelves().Find(alarm_) != nullptr) return {};
    return BadArgument(AlarmShelves::FullText());
  }

  [[nodiscard]] Result<> ReadTime(const DriverCommand& command) {
    constexpr std::int64_t kMaxSeconds = AlarmShelves::kLongestUs / kUsPerSecond;
    const auto seconds = FindArgument(command.arguments, "seconds");
    const auto until = FindArgument(command.arguments, "until");
    if (seconds.has_value() == until.has_value()) {
      return BadArgument("shelve_alarm takes exactly one of seconds and until");
    }
    if (seconds) {
      const auto given = ParseWhole(*seconds, 1, kMaxSeconds);
      if (!given) return BadArgument("seconds is not a whole number from 1 to " + std::to_string(kMaxSeconds));
      shelf_.until_utime = unix_us_ + *given * kUsPerSecond;
      return {};
    }
    const auto given = ParseWhole(*until, unix_us_ + 1, unix_us_ + AlarmShelves::kLongestUs);
    if (!given) {
      return BadArgument("until is not a UNIX time in us within the next " + std::to_string(kMaxSeconds) + " s");
    }
    shelf_.until_utime = *given;
    return {};
  }

  [[nodiscard]] Result<> ReadSeverity(const AlarmTable& alarms, const DriverCommand& command) {
    const auto up_to = FindArgument(command.arguments, "up_to");
    shelf_.up_to = standing_.severity;
    if (up_to) {
      const auto severity = ParseSeverity(*up_to);
      if (!severity) return BadArgument("up_to is not one of info, warning, error, critical");
      shelf_.up_to = *severity;
    } else if (!standing_.known) {
      const std::string names = alarms.Names();
      return BadArgument("no alarm " + alarm_ + " has come since the driver started; " +
                         (names.empty() ? "there is no alarm" : "there are " + names) +
                         "; to shelve it before it comes, give up_to");
    }
    return {};
  }

  [[nodiscard]] std::vector<Change> Changes() const {
    const std::string before = standing_.acknowledged ? "acknowledged"
                               : standing_.present    ? "present"
                               : standing_.gone       ? "gone"
                                                      : "absent";
    switch (kind_) {
      case Kind::kAcknowledge:
        return {{"alarm", before, standing_.present ? "acknowledged" : "cleared"}};
      case Kind::kShelve:
        return {{"alarm", before, "shelved"},
                {"until", "", std::to_string(shelf_.until_utime)},
                {"up_to", "", std::string(kSeverityNames.at(shelf_.up_to))}};
      case Kind::kUnshelve:
        return {{"alarm", "shelved", before}};
      case Kind::kExpect:
        break;
    }
    return {};
  }

  // Returns "battery_error is acknowledged", or "would be" if not `done`.
  [[nodiscard]] std::string Text(bool done) const {
    const std::string is = done ? " is " : " would be ";
    switch (kind_) {
      case Kind::kAcknowledge:
        if (standing_.acknowledged) return alarm_ + " was acknowledged before";
        return alarm_ + is +
               (standing_.present ? "acknowledged; it is still present"
                                  : "removed from the list: its cause has gone");
      case Kind::kShelve:
        return alarm_ + is + "shelved for " + std::to_string((shelf_.until_utime - unix_us_) / kUsPerSecond) +
               " s, up to severity " + std::string(kSeverityNames.at(shelf_.up_to));
      case Kind::kUnshelve:
        return alarm_ + is + "unshelved";
      case Kind::kExpect:
        break;
    }
    return alarm_ + is + "taken as acknowledged before";
  }

  Kind kind_;
  std::string alarm_;
  std::int64_t unix_us_;
  AlarmTable::Standing standing_;
  AlarmShelves::Shelf shelf_;
};

// A command about the datum of an axis.
class DatumCommand {
 public:
  // Checks the command against the axis.
  [[nodiscard]] static Result<DatumCommand> Make(const DevicePublisher& publisher, const DriverCommand& command,
                                                 std::int64_t unix_us) {
    DatumCommand made(publisher);
    Result<> checked;
    if (command.operation == "set_datum") {
      made.kind_ = Kind::kSet;
      checked = made.CheckSet(publisher, command, unix_us);
    } else if (command.operation == "clear_datum") {
      made.kind_ = Kind::kClear;
      checked = made.CheckClear();
      made.value_after_ = publisher.ValueWith(made.file_datum_ ? made.file_datum_->counts : 0);
    }
    if (!checked) return Failure(checked.error());
    return made;
  }

  [[nodiscard]] Outcome Prepared() const {
    Outcome outcome{.state = CommandState::kSucceeded, .changes = {}};
    if (kind_ == Kind::kMarkLost) {
      outcome.text = "would mark the reference as lost";
      return outcome;
    }
    outcome.text = kind_ == Kind::kSet ? "would set the datum to " + DatumText(datum_) + " counts"
                                       : "would clear the datum, " + DatumText(datum_before_) + " counts";
    outcome.changes = Changes(value_after_ ? ValueText(*value_after_) : "");
    return outcome;
  }

  [[nodiscard]] Outcome Apply(DevicePublisher& publisher) const {
    Outcome outcome{.state = CommandState::kSucceeded, .verified = true, .changes = {}};
    if (kind_ == Kind::kMarkLost) {
      publisher.OnReferenceLost();
      outcome.text = "the reference is marked as lost";
      return outcome;
    }
    if (kind_ == Kind::kSet) {
      publisher.SetDatum(datum_.counts, datum_.unix_us);
      outcome.text = "datum set to " + std::to_string(datum_.counts) + " counts";
    } else {
      publisher.ClearDatum();
      outcome.text = file_datum_ ? "the datum of the machine's file is used again" : "the datum is cleared";
    }
    outcome.changes = Changes(ValueText(publisher.summary().value));
    return outcome;
  }

 private:
  enum class Kind : std::uint8_t { kSet, kClear, kMarkLost };

  explicit DatumCommand(const DevicePublisher& publisher) {
    const DevicePublisher::Summary now = publisher.summary();
    value_before_ = now.value;
    datum_before_ = now.datum;
    file_datum_ = now.file_datum;
    identity_ = now.identity;
  }

  [[nodiscard]] Result<> CheckSet(const DevicePublisher& publisher, const DriverCommand& command,
                                  std::int64_t unix_us) {
    const auto value = FindArgument(command.arguments, "value");
    const auto counts = FindArgument(command.arguments, "counts");
    if (value.has_value() == counts.has_value()) {
      return BadArgument("set_datum takes exactly one of value and counts");
    }
    datum_.unix_us = unix_us;
    if (const auto established = FindArgument(command.arguments, "utime")) {
      const auto given = ParseDatum<std::int64_t>(*established);
      if (!given || *given < 0) return BadArgument("utime is not a UNIX time in whole microseconds");
      dated_ = true;
      datum_.unix_us = *given;
    }
    if (const auto expected = FindArgument(command.arguments, "identity"); expected && !expected->empty()) {
      if (Result<> same = CheckIdentity(std::string(*expected)); !same) return same;
    }
    return value ? ReadCounts(publisher, "value", *value) : ReadCounts(publisher, "counts", *counts);
  }

  [[nodiscard]] Result<> CheckIdentity(const std::string& expected) const {
    if (identity_.empty()) {
      return Failure("the encoder has not reported its identity yet, " + expected +
                         " is expected: repeat the command when it is online",
                     Status::REASON_DEVICE_OFFLINE);
    }
    if (identity_ == expected) return {};
    return Failure("the encoder is " + identity_ + ", and the datum is for " + expected +
                       ": accept the exchange, then set a new datum",
                   Status::REASON_WRONG_IDENTITY);
  }

  [[nodiscard]] Result<> ReadCounts(const DevicePublisher& publisher, const std::string& key,
                                    std::string_view text) {
    const auto number = ParseDatum<double>(text);
    if (!number) return BadArgument(key + " is not a number within +-9e15");
    if (key == "counts") {
      datum_.counts = static_cast<std::int64_t>(*number);
      if (static_cast<double>(datum_.counts) != *number) return BadArgument("counts is not a whole number");
    } else {
      const auto datum = publisher.DatumFor(*number);
      if (!datum) return Failure("no valid position is known yet", Status::REASON_DEVICE_OFFLINE);
      datum_.counts = *datum;
    }
    // With an older datum, the encoder's turns are counted from that datum again: the value is not known yet.
    if (!dated_) value_after_ = publisher.ValueWith(datum_.counts);
    return {};
  }

  [[nodiscard]] Result<> CheckClear() const {
    if (!datum_before_) return Failure("no datum is set: there is nothing to clear", Status::REASON_NO_DATUM);
    if (datum_before_ != file_datum_) return {};
    return Failure("the present datum, " + DatumText(datum_before_) +
                       " counts, is set in the machine's file: remove datum_counts there",
                   Status::REASON_NOT_PERMITTED);
  }

  [[nodiscard]] std::optional<Reference::Datum> DatumAfter() const {
    return kind_ == Kind::kSet ? datum_ : file_datum_;
  }

  [[nodiscard]] std::vector<Change> Changes(std::string value_after) const {
    return {{"value", ValueText(value_before_), std::move(value_after)},
            {"datum_counts", DatumText(datum_before_), DatumText(DatumAfter())},
            {"identity", "", identity_}};
  }

  Kind kind_ = Kind::kMarkLost;
  Reference::Datum datum_;  // to be set
  bool dated_ = false;      // established at another time than now
  double value_before_;
  std::optional<double> value_after_;
  std::optional<Reference::Datum> datum_before_;
  std::optional<Reference::Datum> file_datum_;
  std::string identity_;
};

}  // namespace

std::string ValueText(double value) {
  if (std::isnan(value)) return "";
  char text[32];
  const auto [end, error] = std::to_chars(std::begin(text), std::end(text), value);
  return error == std::errc() ? std::string(text, end) : std::string();
}

Result<Outcome> ExecuteAxisCommand(DevicePublisher& publisher, const DriverCommand& command, std::int64_t unix_us) {
  const auto apply = [&](const auto& made) { return made.Apply(publisher); };
  if (IsAboutAlarms(command.operation)) return AlarmCommand::Make(publisher, command, unix_us).map(apply);
  return DatumCommand::Make(publisher, command, unix_us).map(apply);
}

Result<Outcome> PrepareAxisCommand(const DevicePublisher& publisher, const DriverCommand& command,
                                   std::int64_t unix_us) {
  const auto prepare = [](const auto& made) { return made.Prepared(); };
  if (IsAboutAlarms(command.operation)) return AlarmCommand::Make(publisher, command, unix_us).map(prepare);
  return DatumCommand::Make(publisher, command, unix_us).map(prepare);
}

}  // namespace axlecast
