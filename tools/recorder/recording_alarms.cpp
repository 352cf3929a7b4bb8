#include "tools/recorder/recording_alarms.h"

#include <algorithm>

namespace axlecast {

RecordingAlarms::RecordingAlarms(const std::string& name, std::int64_t boot_id) {
  message_.boot_id = boot_id;
  message_.seq = -1;
  message_.device = "recorder/" + name;
}

const alarm_t& RecordingAlarms::Make(const RecordingStatus& status, MonoNs now, std::int64_t utime) {
  using namespace recording_alarms;
  const auto set = [&](const AlarmSpec& alarm, bool present, bool lasts) {
    const AlarmState gone = lasts ? AlarmState::kDriverLatched : AlarmState::kAbsent;
    book_.Set(alarm, present ? AlarmState::kLive : gone, utime);
  };
  // A drop by the kernel, whose gap may show later, is a loss already.
  const std::int64_t missing = std::max(status.Lost(), status.intake.kernel_dropped);
  set(kDiskFull, status.disk.state == DiskState::kFull, false);
  set(kDiskFails, status.disk.state == DiskState::kFailed, status.disk.damaged);
  set(kMessagesLost, missing > missing_before_, missing > 0);
  missing_before_ = missing;
  message_.utime = utime;
  message_.mono_ns = now;
  book_.Write(message_, utime);
  ++message_.seq;
  return message_;
}

}  // namespace axlecast
