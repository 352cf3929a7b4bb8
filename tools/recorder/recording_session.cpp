#include "tools/recorder/recording_session.h"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <utility>

#include "platform/os/system_clock.h"

namespace axlecast {
namespace {

constexpr std::int64_t kPollEvery = 4'096;  // messages between two looks at the clock and the disk
constexpr MonoNs kTurn = 500'000;           // ns; what comes within it is written together

}  // namespace

RecordingSession::RecordingSession(RecordingSettings settings, const Clock& clock)
    : clock_(clock),
      urls_(std::move(settings.urls)),
      queue_(settings.queue_bytes),
      intake_(std::move(settings.filter), queue_, clock),
      writer_(std::move(settings.writer), clock),
      recorder_(std::move(settings.recorder), writer_) {}

RecordingSession::~RecordingSession() { Stop(); }

void RecordingSession::Append(const LogTail& tail) {
  append_ = tail;
  writer_.Append(static_cast<std::int64_t>(tail.size));
}

std::string RecordingSession::Open() {
  for (const std::string& url : urls_) {
    if (std::string problem = intake_.Listen(url); !problem.empty()) return problem;
  }
  if (append_) {
    recorder_.Continue(*append_, clock_.Now(), clock_.UtcMicroseconds());
  } else {
    recorder_.Start(clock_.Now(), clock_.UtcMicroseconds());
  }
  writer_.Poll();
  Share();
  return writer_.blocked() ? writer_.status().last_error : "";
}

void RecordingSession::Start() {
  reader_thread_ = std::thread([this] { Read(); });
  writer_thread_ = std::thread([this] { Write(); });
}

void RecordingSession::Stop() {
  stop_.Set();
  if (reader_thread_.joinable()) reader_thread_.join();
  if (writer_thread_.joinable()) writer_thread_.join();
}

void RecordingSession::Read() {
  std::string failure = intake_.Run(stop_.FileDescriptor());
  {
    const std::scoped_lock lock(mutex_);
    shared_.failure = std::move(failure);
  }
  queue_.Close();
}

void RecordingSession::Write() {
  MessageBatch batch;
  std::array<pollfd, 1> files = {{{queue_.FileDescriptor(), POLLIN, 0}}};
  MonoNs next_turn = clock_.Now();
  for (bool open = true; open;) {
    static_cast<void>(PollUntil(files, std::min(writer_.next_poll(), recorder_.next_poll()), clock_));
    if (clock_.Now() < next_turn) static_cast<void>(PollUntil({}, next_turn, clock_));
    next_turn = clock_.Now() + kTurn;
    open = queue_.Take(batch);
    WriteBatch(batch);
    recorder_.Poll(clock_.Now(), clock_.UtcMicroseconds());
    writer_.Poll();
    Share();
    if (batch.left() > 0) break;
  }
  Finish(batch);
}

// Stands still while the disk takes nothing; leaves messages only when the recording ends meanwhile.
void RecordingSession::WriteBatch(MessageBatch& batch) {
  std::array<pollfd, 1> files = {{{stop_.FileDescriptor(), POLLIN, 0}}};
  while (batch.left() > 0) {
    Record(batch, kPollEvery);
    recorder_.Poll(clock_.Now(), clock_.UtcMicroseconds());
    writer_.Poll();
    Share();
    if (!writer_.blocked()) continue;
    if (PollUntil(files, writer_.next_poll(), clock_) > 0) return;
  }
}

// At most so many messages, and none while the disk takes nothing.
void RecordingSession::Record(MessageBatch& batch, std::int64_t maximum) {
  const MonoNs now = clock_.Now();
  for (std::int64_t i = 0; i < maximum && !writer_.blocked(); ++i) {
    const auto message = batch.Next();
    if (!message) return;
    recorder_.On(*message, now);
  }
}

void RecordingSession::Finish(MessageBatch& batch) {
  std::int64_t unwritten = 0;
  // The reading thread ends first; what it still brings is written where the disk takes something again.
  std::array<pollfd, 1> files = {{{queue_.FileDescriptor(), POLLIN, 0}}};
  for (bool open = true; open;) {
    Record(batch, batch.left());
    unwritten += batch.left();
    open = queue_.Take(batch);
    if (open && batch.left() == 0) static_cast<void>(PollUntil(files, clock_.Now() + kSecond, clock_));
  }
  recorder_.End(clock_.UtcMicroseconds());
  const std::int64_t held = writer_.Finish();
  Share();
  const std::scoped_lock lock(mutex_);
  shared_.messages -= held;
  shared_.unwritten = unwritten + held;
  shared_.channels = recorder_.channels().losses();
}

void RecordingSession::Share() {
  const std::scoped_lock lock(mutex_);
  shared_.disk = writer_.status();
  shared_.recording = recorder_.recording();
  shared_.messages = recorder_.messages();
  shared_.bytes = recorder_.bytes();
  shared_.early = recorder_.early();
}

RecordingStatus RecordingSession::status() const {
  IntakeCounts intake = intake_.counts();
  const std::scoped_lock lock(mutex_);
  RecordingStatus status = shared_;
  status.intake = std::move(intake);
  return status;
}

bool RecordingSession::Reads() {
  const std::uint64_t turns = intake_.turns();
  return std::exchange(turns_, turns) != turns;
}

bool RecordingSession::failed() const {
  const std::scoped_lock lock(mutex_);
  return !shared_.failure.empty();
}

}  // namespace axlecast
