#include "drivers/runtime/command/alarm_order.h"

#include <axlecast/command_status_t.hpp>
#include <utility>

#include "core/base/spelling.h"
#include "core/base/text.h"
#include "core/command/operation_check.h"
#include "drivers/kit/arguments.h"

namespace axlecast {
namespace {

using Status = command_status_t;

constexpr std::int64_t kUsPerSecond = 1'000'000;

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

}  // namespace axlecast
