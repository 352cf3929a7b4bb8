#pragma once

#include <axlecast/alarm_t.hpp>
#include <axlecast/recorder_health_t.hpp>
#include <cstdint>
#include <string>
#include <utility>

#include "core/alarm/alarm_table.h"
#include "core/base/time.h"
#include "core/messages/origin.h"
#include "tools/recorder/recording_session.h"

namespace axlecast {

// Makes the message that a recorder publishes on RECORDER/<name>.
class RecordingHealth {
 public:
  RecordingHealth(std::string name, const Origin& origin) : name_(std::move(name)), origin_(origin) {}

  // Rates are averages since the previous call. `utime`: us, UNIX time of `now`.
  [[nodiscard]] recorder_health_t Make(const RecordingStatus& status, MonoNs now, std::int64_t utime,
                                       bool stopping);

 private:
  std::string name_;
  Origin origin_;
  std::int64_t seq_ = 0;
  MonoNs before_ = 0;
  std::int64_t messages_before_ = 0;
  std::int64_t bytes_before_ = 0;
};

// Makes the message that a recorder publishes on ALARM/recorder/<name>.
class RecordingAlarms {
 public:
  RecordingAlarms(const std::string& name, const Origin& origin) : alarms_("recorder/" + name, origin) {}

  // `utime`: us, UNIX time of `now`. The reference is valid until the next call.
  [[nodiscard]] const alarm_t& Make(const RecordingStatus& status, MonoNs now, std::int64_t utime);

 private:
  ProgramAlarms alarms_;
  std::int64_t missing_before_ = 0;
  std::int64_t deleted_before_ = 0;
};

}  // namespace axlecast
