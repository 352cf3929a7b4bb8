#pragma once

#include <cstdint>
#include <memory>
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
  ChannelFilter filter;
  std::size_t queue_bytes = 64U << 20;  // between the network and the disk
};

// How a recording stands.
struct RecordingStatus {
  IntakeCounts intake;
  LogWriterStatus disk;
  bool recording = false;             // else it waits for the trigger
  std::int64_t messages = 0;          // given to the disk, without header events and seals
  std::int64_t bytes = 0;             // of all logs
  std::int64_t early = 0;             // messages that left the memory of before the trigger early
  std::int64_t unwritten = 0;         // messages that the disk did not take, at the end
  std::vector<ChannelLoss> channels;  // at the end
  std::string failure;                // why it ended by itself

  // Messages that should be in a log and are not, as far as it is known.
  [[nodiscard]] std::int64_t Lost() const { return intake.lost + intake.overflow + unwritten; }
  [[nodiscard]] bool Whole() const { return Lost() == 0 && intake.kernel_dropped == 0; }
  [[nodiscard]] bool Failed() const { return unwritten > 0 || disk.damaged || !failure.empty(); }
};

// A recording from its start to its end: one thread reads from the network and never waits for the disk, another one
// writes.
class RecordingSession {
 public:
  RecordingSession(RecordingSettings settings, const Clock& clock);
  ~RecordingSession();
  RecordingSession(const RecordingSession&) = delete;
  RecordingSession& operator=(const RecordingSession&) = delete;

  // Goes on with the log that stands in `tail`.
  void Append(const LogTail& tail);
  // Joins the groups and opens the first log. Empty when both work, else the cause and the remedy.
  [[nodiscard]] std::string Open();
  [[nodiscard]] const std::vector<std::string>& warnings() const { return intake_.warnings(); }

  void Start();
  // Writes all that has come by now, and ends.
  void Stop();

  [[nodiscard]] RecordingStatus status() const;
  [[nodiscard]] bool failed() const;  // it ended by itself
  // Whether the reading thread has got on since the call before. A disk that stands still does not count: what comes
  // meanwhile is kept, and a restart would lose it.
  [[nodiscard]] bool Reads();

 private:
  void Read();
  void Write();
  void WriteBatch(MessageBatch& batch);
  void Record(MessageBatch& batch, std::int64_t maximum);
  void Finish(MessageBatch& batch);
  void Share();

  const Clock& clock_;
  std::vector<std::string> urls_;
  MessageQueue queue_;
  MessageReceiver intake_;
  LogWriter writer_;
  LogComposer recorder_;
  std::optional<LogTail> append_;
  WakeEvent stop_;
  std::thread reader_thread_;
  std::thread writer_thread_;
  mutable std::mutex mutex_;
  std::uint64_t turns_ = 0;  // of the reading thread, at the last Reads
  RecordingStatus shared_;   // what the writing thread and the end of the reading one tell
};

}  // namespace axlecast
