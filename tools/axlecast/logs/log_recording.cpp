#include "tools/axlecast/logs/log_recording.h"

#include <unistd.h>

#include <iostream>
#include <utility>

#include "platform/os/mapped_file.h"
#include "platform/os/process.h"
#include "tools/log/log_seal.h"

namespace axlecast {

LogRecording::LogRecording(RecordingSettings settings, const Clock& clock)
    : name_(settings.recorder.identity.name),
      urls_(settings.urls),
      clock_(clock),
      boot_id_(RandomBootId()),
      health_(name_, boot_id_),
      alarms_(name_, boot_id_),
      recording_(std::move(settings), clock) {}

std::string LogRecording::Continue(const std::string& file) {
  if (access(file.c_str(), F_OK) != 0) return "";  // it begins a new one
  const MappedFile log(file);
  if (!log.problem().empty()) return log.problem();
  const LogTail tail = FindTail(log.bytes());
  if (std::string loss = log.Loss(); !loss.empty()) return loss;
  if (!log.bytes().empty() && tail.size == 0) {
    return file + ": holds no event of LCM, and is left as it is; choose another name";
  }
  if (tail.torn > 0) std::cerr << file << ": cuts off a torn end of " << tail.torn << " bytes\n";
  recording_.Append(tail);
  return "";
}

recorder_health_t LogRecording::Tell(LcmPort& port, bool stopping, std::vector<std::string>& errors) {
  const RecordingStatus status = recording_.status();
  const MonoNs now = clock_.Now();
  const std::int64_t utime = clock_.UtcMicroseconds();
  recorder_health_t health = health_.Make(status, now, utime, stopping);
  static_cast<void>(Publish(port, "RECORDER/" + name_, health));
  static_cast<void>(Publish(port, "ALARM/recorder/" + name_, alarms_.Make(status, now, utime)));
  TellErrors(status.disk, errors);
  return health;
}

void LogRecording::TellErrors(const LogWriterStatus& disk, std::vector<std::string>& errors) {
  if (disk.last_error_utime != 0 && disk.last_error != told_) {
    errors.push_back(disk.last_error);
    told_ = disk.last_error;
  } else if (disk.state == DiskState::kGood && bad_) {
    errors.push_back(disk.file + ": the disk takes events again");
    told_.clear();
  }
  bad_ = disk.state != DiskState::kGood;
}

}  // namespace axlecast
