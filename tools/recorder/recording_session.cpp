#include "tools/recorder/recording_session.h"

#include <poll.h>

#include <algorithm>
#include <array>
#include <utility>

#include "platform/os/system_clock.h"

namespace axlecast {
namespace {

constexpr std::int64_t kPollEvery = 4'096;  // messages between two checks of the clock and the disk
constexpr MonoNs kBatch = 500'000;          // ns; messages within this time are written together

}  // namespace

RecordingSession::RecordingSession(RecordingSettings settings, const Clock& clock)
    : clock_(clock),
      urls_(std::move(settings.urls)),
      queue_(settings.queue_bytes),
      receiver_(std::move(settings.filter), settings.machine, queue_, clock),
      writer_(std::move(settings.writer), clock),
      composer_(std::move(settings.recorder), writer_) {}

RecordingSession::~RecordingSession() { Stop(); }

void RecordingSession::Append(const LogTail& tail) {
  append_ = tail;
  writer_.Append(static_cast<std::int64_t>(tail.size));
}

Result<> RecordingSession::Open() {
  for (const std::string& url : urls_) {
    if (Result<> listening = receiver_.Listen(url); !listening) return listening;
  }
  if (append_) {
    composer_.Continue(*append_, clock_.Now(), clock_.UtcMicroseconds());
  } else {
    composer_.Start(clock_.Now(), clock_.UtcMicroseconds());
  }
  writer_.Poll();
  PublishStatus();
  if (writer_.blocked()) return Failure(writer_.status().last_error);
  return {};
}

void RecordingSession::Start() {
  reader_thread_ = std::thread([this] { RunReceiver(); });
  writer_thread_ = std::thread([this] { RunWriter(); });
}

void RecordingSession::Stop() {
  stop_.Set();
  if (reader_thread_.joinable()) reader_thread_.join();
  if (writer_thread_.joinable()) writer_thread_.join();
}

void RecordingSession::RunReceiver() {
  const Result<> received = receiver_.Run(stop_.FileDescriptor());
  if (!received) {
    const std::scoped_lock lock(mutex_);
    shared_.failure = received.error().text;
  }
  queue_.Close();
}

void RecordingSession::RunWriter() {
  MessageBatch batch;
  std::array<pollfd, 1> files = {{{queue_.FileDescriptor(), POLLIN, 0}}};
  MonoNs next_batch = clock_.Now();
  for (bool open = true; open;) {
    static_cast<void>(PollUntil(files, std::min(writer_.next_poll(), composer_.next_poll()), clock_));
    if (clock_.Now() < next_batch) static_cast<void>(PollUntil({}, next_batch, clock_));
    next_batch = clock_.Now() + kBatch;
    open = queue_.Take(batch);
    WriteBatch(batch);
    composer_.Poll(clock_.Now(), clock_.UtcMicroseconds());
    writer_.Poll();
    PublishStatus();
    if (batch.left() > 0) break;
  }
  Finish(batch);
}

// Waits while the disk is blocked. Messages remain in the batch only if the recording is stopped meanwhile.
void RecordingSession::WriteBatch(MessageBatch& batch) {
  std::array<pollfd, 1> files = {{{stop_.FileDescriptor(), POLLIN, 0}}};
  while (batch.left() > 0) {
    Record(batch, kPollEvery);
    composer_.Poll(clock_.Now(), clock_.UtcMicroseconds());
    writer_.Poll();
    PublishStatus();
    if (!writer_.blocked()) continue;
    if (PollUntil(files, writer_.next_poll(), clock_) > 0) return;
  }
}

// Records at most `maximum` messages. Stops when the disk is blocked.
void RecordingSession::Record(MessageBatch& batch, std::int64_t maximum) {
  const MonoNs now = clock_.Now();
  for (std::int64_t i = 0; i < maximum && !writer_.blocked(); ++i) {
    const auto message = batch.Next();
    if (!message) return;
    composer_.On(*message, now);
  }
}

void RecordingSession::Finish(MessageBatch& batch) {
  std::int64_t unwritten = 0;
  // The waiting messages are written if a disk that was blocked has space again.
  writer_.Retry();
  // The receiving thread ends first. Its last messages are written if the disk is not blocked.
  std::array<pollfd, 1> files = {{{queue_.FileDescriptor(), POLLIN, 0}}};
  for (bool open = true; open;) {
    Record(batch, batch.left());
    unwritten += batch.left();
    open = queue_.Take(batch);
    if (open && batch.left() == 0) static_cast<void>(PollUntil(files, clock_.Now() + kSecond, clock_));
  }
  composer_.End(clock_.UtcMicroseconds());
  const std::int64_t held = writer_.Finish();
  PublishStatus();
  const std::scoped_lock lock(mutex_);
  shared_.messages -= held;
  shared_.unwritten = unwritten + held;
  shared_.channels = composer_.channels().losses();
}

void RecordingSession::PublishStatus() {
  const std::scoped_lock lock(mutex_);
  shared_.disk = writer_.status();
  shared_.recording = composer_.recording();
  shared_.messages = composer_.messages();
  shared_.bytes = composer_.bytes();
  shared_.early = composer_.early();
}

RecordingStatus RecordingSession::status() const {
  ReceiverCounts counts = receiver_.counts();
  const std::scoped_lock lock(mutex_);
  RecordingStatus status = shared_;
  status.receiver = std::move(counts);
  return status;
}

bool RecordingSession::HasProgress() {
  const std::uint64_t iterations = receiver_.iterations();
  return std::exchange(iterations_, iterations) != iterations;
}

}  // namespace axlecast
