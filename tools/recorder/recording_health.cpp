#include "tools/recorder/recording_health.h"

#include <algorithm>
#include <limits>

#include "core/alarm/alarm_codes.h"
#include "core/base/text.h"
#include "core/messages/lcm_url.h"
#include "core/messages/message.h"

namespace axlecast {
namespace {

// Limits of recorder_health_t.lcm.
constexpr std::size_t kFileBytes = 200;
constexpr std::size_t kErrorBytes = 160;
constexpr std::size_t kMaxSenders = 16;

std::int8_t StateOf(const RecordingStatus& status, bool stopping) {
  if (status.HasFailed() || status.disk.state == DiskState::kFailed) return recorder_health_t::STATE_ERROR;
  if (status.disk.state == DiskState::kFull) return recorder_health_t::STATE_DISK_FULL;
  if (stopping) return recorder_health_t::STATE_STOPPING;
  return status.recording ? recorder_health_t::STATE_RECORDING : recorder_health_t::STATE_PRE_TRIGGER;
}

// Truncates a long path at its beginning, because its end is more useful.
std::string EndOf(const std::string& path) {
  return CappedText(path.size() <= kFileBytes ? path : path.substr(path.size() - kFileBytes), kFileBytes);
}

}  // namespace

recorder_health_t RecordingHealth::Make(const RecordingStatus& status, MonoNs now, std::int64_t utime,
                                        bool stopping) {
  recorder_health_t health{};
  health.utime = utime;
  health.mono_ns = now;
  origin_.Set(health);
  health.seq = seq_++;
  health.name = name_;
  health.file = EndOf(status.disk.file);
  health.state = StateOf(status, stopping);
  health.file_bytes = status.disk.file_bytes;
  health.total_bytes = status.bytes;
  health.messages = status.messages;
  health.lost = status.Lost();
  health.kernel_dropped = status.receiver.kernel_dropped;
  health.free_bytes = std::max<std::int64_t>(status.disk.free_bytes, 0);
  if (before_ != 0 && now > before_) {
    const double seconds = static_cast<double>(now - before_) / 1e9;
    health.messages_hz = static_cast<float>(static_cast<double>(status.messages - messages_before_) / seconds);
    health.bytes_hz = static_cast<float>(static_cast<double>(status.bytes - bytes_before_) / seconds);
  }
  before_ = now;
  messages_before_ = status.messages;
  bytes_before_ = status.bytes;
  const auto& senders = status.receiver.senders;
  health.total_senders =
      static_cast<std::int16_t>(std::min<std::size_t>(senders.size(), std::numeric_limits<std::int16_t>::max()));
  for (std::size_t i = 0; i < std::min(senders.size(), kMaxSenders); ++i) {
    sender_loss_t& sender = health.senders.emplace_back();
    sender.sender = SenderText(senders[i].sender);
    sender.received = senders[i].received;
    sender.lost = senders[i].lost;
  }
  health.n_senders = static_cast<std::int8_t>(health.senders.size());
  health.last_error = CappedText(status.disk.last_error, kErrorBytes);
  health.last_error_utime = status.disk.last_error_utime;
  for (; health.getEncodedSize() > kMaxMessage && health.n_senders > 0; --health.n_senders)
    health.senders.pop_back();
  return health;
}

const alarm_t& RecordingAlarms::Make(const RecordingStatus& status, MonoNs now, std::int64_t utime) {
  using namespace recording_alarms;
  // A datagram that the kernel dropped counts as lost, even if its gap is detected later.
  const std::int64_t missing = std::max(status.Lost(), status.receiver.kernel_dropped);
  alarms_.Set(kDiskFull, status.disk.state == DiskState::kFull, utime);
  alarms_.Set(kDiskFails, status.disk.state == DiskState::kFailed, utime, status.disk.damaged);
  alarms_.Set(kMessagesLost, missing > missing_before_, utime, missing > 0);
  missing_before_ = missing;
  const ClosedLogsStatus& closed = status.disk.closed;
  alarms_.Set(kLogsNotShipped, closed.held_logs > 0, utime);
  alarms_.Set(kLogDeletedUnshipped, closed.deleted_unshipped > deleted_before_, utime,
              closed.deleted_unshipped > 0);
  deleted_before_ = closed.deleted_unshipped;
  return alarms_.Make({now, utime});
}

}  // namespace axlecast
