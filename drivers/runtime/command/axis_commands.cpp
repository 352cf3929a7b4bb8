#include "drivers/runtime/command/axis_commands.h"

#include <axlecast/command_status_t.hpp>
#include <charconv>
#include <cmath>
#include <utility>

#include "core/base/spelling.h"
#include "core/base/text.h"
#include "core/command/operation_check.h"
#include "drivers/kit/arguments.h"

namespace axlecast {
namespace {

using Status = command_status_t;

constexpr std::int64_t kUsPerSecond = 1'000'000;

// Beyond it a double no longer tells neighbouring counts apart, and sums could leave 64 bits.
constexpr double kLargestDatum = 9.0e15;

template <typename Number>
std::optional<Number> Parse(std::string_view text) {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  if (!(std::abs(static_cast<double>(number)) <= kLargestDatum)) return std::nullopt;  // NaN, too
  return number;
}

const std::string* Find(const DriverCommand& order, std::string_view key) {
  for (const auto& [name, value] : order.arguments) {
    if (name == key) return &value;
  }
  return nullptr;
}

std::string DatumText(const std::optional<Reference::Datum>& datum) {
  return datum ? std::to_string(datum->counts) : "none";
}

}  // namespace

AlarmOrder::AlarmOrder(const DevicePublisher& channel, const DriverCommand& order, std::int64_t utime)
    : kind_(KindOf(order.operation)),
      alarm_(FindArgument(order.arguments, "alarm").value_or("")),
      utime_(utime),
      standing_(channel.alarms().Look(alarm_)) {
  Judge(channel.alarms(), order);
}

AlarmOrder::Kind AlarmOrder::KindOf(std::string_view operation) {
  if (operation == kAcknowledgeAlarm) return Kind::kAcknowledge;
  if (operation == kShelveAlarm) return Kind::kShelve;
  return operation == kUnshelveAlarm ? Kind::kUnshelve : Kind::kExpect;
}

void AlarmOrder::Judge(const AlarmTable& alarms, const DriverCommand& order) {
  const bool is_word = alarm_.find_first_of(" *") == std::string::npos && alarm_ == CappedText(alarm_, kNameBytes);
  if (alarm_.empty() || !is_word) {
    return Refuse("alarm is no name of an alarm: one word of at most 24 bytes, as ALARM says it");
  }
  if (kind_ == Kind::kAcknowledge) return JudgeAcknowledge(alarms);
  if (kind_ == Kind::kShelve) return JudgeShelve(alarms, order);
  if (kind_ == Kind::kUnshelve && alarms.shelves().Find(alarm_) == nullptr) {
    Refuse(alarm_ + " is not shelved: there is nothing to take back");
  }
}

void AlarmOrder::Refuse(std::string text) {
  if (refusal_) return;
  refusal_ = Outcome{.state = CommandState::kRejected,
                     .reason = Status::REASON_BAD_ARGUMENT,
                     .text = std::move(text),
                     .changes = {}};
}

void AlarmOrder::JudgeAcknowledge(const AlarmTable& alarms) {
  if (standing_.present || standing_.gone) return;
  const std::string names = alarms.Names();
  Refuse(alarm_ + " is not listed: there is nothing to acknowledge; " +
         (names.empty() ? "there is no alarm" : "there are " + names));
}

void AlarmOrder::JudgeShelve(const AlarmTable& alarms, const DriverCommand& order) {
  shelf_.alarm = alarm_;
  JudgeTime(order);
  JudgeSeverity(alarms, order);
  if (alarms.shelves().IsFull() && alarms.shelves().Find(alarm_) == nullptr) {
    Refuse(std::to_string(AlarmShelves::kMax) + " alarms of this device are shelved already: unshelve some");
  }
}

void AlarmOrder::JudgeTime(const DriverCommand& order) {
  constexpr std::int64_t kMaxSeconds = AlarmShelves::kLongestUs / kUsPerSecond;
  const auto seconds = FindArgument(order.arguments, "seconds");
  const auto until = FindArgument(order.arguments, "until");
  if (seconds.has_value() == until.has_value())
    return Refuse("shelve_alarm takes exactly one of seconds and until");
  if (seconds) {
    const auto given = ParseWhole(*seconds, 1, kMaxSeconds);
    if (!given) return Refuse("seconds is no whole number from 1 to " + std::to_string(kMaxSeconds));
    shelf_.until_utime = utime_ + *given * kUsPerSecond;
    return;
  }
  const auto given = ParseWhole(*until, utime_ + 1, utime_ + AlarmShelves::kLongestUs);
  if (!given) return Refuse("until is no UNIX time in us within the next " + std::to_string(kMaxSeconds) + " s");
  shelf_.until_utime = *given;
}

void AlarmOrder::JudgeSeverity(const AlarmTable& alarms, const DriverCommand& order) {
  const auto up_to = FindArgument(order.arguments, "up_to");
  shelf_.up_to = standing_.severity;
  if (up_to) {
    const auto severity = ParseSeverity(*up_to);
    if (!severity) return Refuse("up_to is none of info, warning, error, critical");
    shelf_.up_to = *severity;
  } else if (!standing_.known) {
    const std::string names = alarms.Names();
    Refuse("no alarm " + alarm_ + " has come since the driver started; " +
           (names.empty() ? "there is none" : "there are " + names) + "; to shelve it beforehand, give up_to");
  }
}

std::vector<Change> AlarmOrder::Changes() const {
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

std::string AlarmOrder::Text(bool done) const {
  const std::string is = done ? " is " : " would be ";
  switch (kind_) {
    case Kind::kAcknowledge:
      if (standing_.acknowledged) return alarm_ + " was acknowledged before";
      return alarm_ + is +
             (standing_.present ? "acknowledged; it is still present" : "listed no more: it has gone");
    case Kind::kShelve:
      return alarm_ + is + "shelved for " + std::to_string((shelf_.until_utime - utime_) / kUsPerSecond) +
             " s, up to severity " + std::string(kSeverityNames.at(shelf_.up_to));
    case Kind::kUnshelve:
      return alarm_ + is + "shelved no more";
    case Kind::kExpect:
      break;
  }
  return alarm_ + is + "taken as acknowledged before";
}

Outcome AlarmOrder::Prepared() const {
  return {.state = CommandState::kSucceeded, .text = Text(false), .changes = Changes()};
}

Outcome AlarmOrder::Apply(DevicePublisher& channel) const {
  AlarmTable& alarms = channel.alarms();
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
      alarms.AcknowledgeAgain(alarm_, utime_ + kExpectedUs);
      break;
  }
  return {.state = CommandState::kSucceeded, .text = Text(true), .verified = true, .changes = Changes()};
}

std::string ValueText(double value) {
  if (std::isnan(value)) return "";
  char text[32];
  const auto [end, error] = std::to_chars(std::begin(text), std::end(text), value);
  return error == std::errc() ? std::string(text, end) : std::string();
}

DatumOrder::DatumOrder(const DevicePublisher& channel, const DriverCommand& order, std::int64_t utime) {
  const DevicePublisher::Summary now = channel.summary();
  value_before_ = now.value;
  datum_before_ = now.datum;
  file_datum_ = now.file_datum;
  identity_ = now.identity;
  if (order.operation == "set_datum") {
    kind_ = Kind::kSet;
    JudgeSet(channel, order, utime);
  } else if (order.operation == "clear_datum") {
    kind_ = Kind::kClear;
    JudgeClear();
    value_after_ = channel.ValueWith(file_datum_ ? file_datum_->counts : 0);
  }
}

void DatumOrder::Refuse(std::int32_t reason, std::string text) {
  if (refusal_) return;
  refusal_ = Outcome{.state = CommandState::kRejected, .reason = reason, .text = std::move(text), .changes = {}};
}

void DatumOrder::JudgeSet(const DevicePublisher& channel, const DriverCommand& order, std::int64_t utime) {
  const std::string* const value = Find(order, "value");
  const std::string* const counts = Find(order, "counts");
  if ((value == nullptr) == (counts == nullptr)) {
    return Refuse(Status::REASON_BAD_ARGUMENT, "set_datum takes exactly one of value and counts");
  }
  datum_.utime = utime;
  if (const std::string* const established = Find(order, "utime")) {
    const auto given = Parse<std::int64_t>(*established);
    if (!given || *given < 0) {
      return Refuse(Status::REASON_BAD_ARGUMENT, "utime is no UNIX time in whole microseconds");
    }
    dated_ = true;
    datum_.utime = *given;
  }
  if (const std::string* const wanted = Find(order, "identity"); wanted != nullptr && !wanted->empty()) {
    JudgeIdentity(*wanted);
  }
  if (value != nullptr) return JudgeCounts(channel, "value", *value);
  JudgeCounts(channel, "counts", *counts);
}

void DatumOrder::JudgeIdentity(const std::string& wanted) {
  if (identity_.empty()) {
    return Refuse(Status::REASON_DEVICE_OFFLINE,
                  "the encoder has not told its identity yet, " + wanted + " is expected: repeat it when online");
  }
  if (identity_ == wanted) return;
  Refuse(Status::REASON_WRONG_IDENTITY, "the encoder is " + identity_ + ", and the datum is for " + wanted +
                                            ": accept the exchange, then set the datum anew");
}

void DatumOrder::JudgeCounts(const DevicePublisher& channel, const std::string& key, const std::string& text) {
  const auto number = Parse<double>(text);
  if (!number) return Refuse(Status::REASON_BAD_ARGUMENT, key + " is no number within +-9e15");
  if (key == "counts") {
    datum_.counts = static_cast<std::int64_t>(*number);
    if (static_cast<double>(datum_.counts) != *number) {
      return Refuse(Status::REASON_BAD_ARGUMENT, "counts is no whole number");
    }
  } else {
    const auto datum = channel.DatumFor(*number);
    if (!datum) return Refuse(Status::REASON_DEVICE_OFFLINE, "no valid position is known yet");
    datum_.counts = *datum;
  }
  // With an older datum the encoder's turns are counted anew from it.
  if (!dated_) value_after_ = channel.ValueWith(datum_.counts);
}

void DatumOrder::JudgeClear() {
  if (!datum_before_) {
    return Refuse(Status::REASON_NO_DATUM, "no datum is in force: there is nothing to clear");
  }
  if (datum_before_ != file_datum_) return;
  Refuse(Status::REASON_NOT_PERMITTED, "the datum in force, " + DatumText(datum_before_) +
                                           " counts, is of the machine's file: take datum_counts out there");
}

std::optional<Reference::Datum> DatumOrder::DatumAfter() const {
  return kind_ == Kind::kSet ? datum_ : file_datum_;
}

std::vector<Change> DatumOrder::Changes(std::string value_after) const {
  return {{"value", ValueText(value_before_), std::move(value_after)},
          {"datum_counts", DatumText(datum_before_), DatumText(DatumAfter())},
          {"identity", "", identity_}};
}

Outcome DatumOrder::Prepared() const {
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

Outcome DatumOrder::Apply(DevicePublisher& channel) const {
  Outcome outcome{.state = CommandState::kSucceeded, .verified = true, .changes = {}};
  if (kind_ == Kind::kMarkLost) {
    channel.OnReferenceLost();
    outcome.text = "the reference is marked as lost";
    return outcome;
  }
  if (kind_ == Kind::kSet) {
    channel.SetDatum(datum_.counts, datum_.utime);
    outcome.text = "datum set to " + std::to_string(datum_.counts) + " counts";
  } else {
    channel.ClearDatum();
    outcome.text = file_datum_ ? "the datum of the machine's file is in force again" : "the datum is cleared";
  }
  outcome.changes = Changes(ValueText(channel.summary().value));
  return outcome;
}

}  // namespace axlecast
