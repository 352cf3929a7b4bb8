#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "platform/os/descriptor.h"
#include "tools/recorder/log_composer.h"
#include "tools/recorder/log_writer.h"
#include "tools/recorder/message_receiver.h"

namespace axlecast {

struct RecordingSettings {
  RecorderSettings recorder;
  LogWriterSettings writer;
  std::vector<std::string> urls;
  std::string machine;  // its name: messages of other machines are refused; empty: those of all are recorded
  ChannelFilter filter;
  std::size_t queue_bytes = 64U << 20;  // of memory between the network and the disk
};

// The state of a recording.
struct RecordingStatus {
  ReceiverCounts receiver;
  LogWriterStatus disk;
  bool recording = false;             // false: it waits for the trigger
  std::int64_t messages = 0;          // passed to the disk, without header events and seals
  std::int64_t bytes = 0;             // of all logs
  std::int64_t early = 0;             // messages that the pre-trigger memory removed early
  std::int64_t unwritten = 0;         // messages that were not written, at the end
  std::vector<ChannelLoss> channels;  // with losses, at the end
  std::string failure;                // the error that ended it; empty: none

  // Returns the number of messages that are missing in the logs, as far as known.
  [[nodiscard]] std::int64_t Lost() const { return receiver.lost + receiver.overflow + unwritten; }
  [[nodiscard]] bool IsComplete() const { return Lost() == 0 && receiver.kernel_dropped == 0; }
  [[nodiscard]] bool HasFailed() const { return unwritten > 0 || disk.damaged || !failure.empty(); }
};

// Runs a recording with two threads. The first one receives and never waits for the disk. The second one writes.
class RecordingSession {
 public:
  RecordingSession(RecordingSettings settings, const Clock& clock);
  ~RecordingSession();
  RecordingSession(const RecordingSession&) = delete;
  RecordingSession& operator=(const RecordingSession&) = delete;

  // Continues an existing log, which ends with `tail`. Call it before Open.
  void Append(const LogTail& tail);
  // Starts to receive, and opens the first log.
  [[nodiscard]] Result<> Open();
  [[nodiscard]] const std::vector<std::string>& warnings() const { return receiver_.warnings(); }

  void Start();
  // Writes all messages that have arrived by now, and ends.
  void Stop();

  [[nodiscard]] RecordingStatus status() const;
  // Returns true if the receiving thread has made progress since the previous call. A blocked disk is not reported here: received
  // messages are kept in memory, and a restart would lose them.
  [[nodiscard]] bool HasProgress();

 private:
  void RunReceiver();
  void RunWriter();
  void WriteBatch(MessageBatch& batch);
  void Record(MessageBatch& batch, std::int64_t maximum);
  void Finish(MessageBatch& batch);
  void PublishStatus();

  const Clock& clock_;
  std::vector<std::string> urls_;
  MessageQueue queue_;
  MessageReceiver receiver_;
  LogWriter writer_;
  LogComposer composer_;
  std::optional<LogTail> append_;
  WakeEvent stop_;
  std::thread reader_thread_;
  std::thread writer_thread_;
  mutable std::mutex mutex_;
  std::uint64_t iterations_ = 0;  // of the receiving thread, at the last HasProgress
  RecordingStatus shared_;        // as of the writing thread and of the end of the receiving one
};

}  // namespace axlecast
