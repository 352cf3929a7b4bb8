#include "tools/recorder/recording_session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <axlecast/position_t.hpp>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/messages/message.h"
#include "platform/os/system_clock.h"
#include "tests/disk/limited_files.h"
#include "tests/support/fake_clock.h"
#include "tests/support/temporary_folder.h"
#include "tools/log/log_event.h"
#include "tools/log/log_reader.h"
#include "tools/recorder/recorder_fixture.h"
#include "tools/recorder/source_fixture.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

// The system's clock, which counts how often it is read.
class CountingClock final : public Clock {
 public:
  [[nodiscard]] MonoNs Now() const override {
    ++readings_;
    return clock_.Now();
  }
  [[nodiscard]] std::int64_t UtcMicroseconds() const override { return clock_.UtcMicroseconds(); }
  [[nodiscard]] std::int64_t readings() const { return readings_; }

 private:
  SystemClock clock_;
  mutable std::atomic<std::int64_t> readings_ = 0;
};

class RecordingSessionTest : public ::testing::Test {
 protected:
  RecordingSessionTest() {
    settings_.writer.file = path_;
    settings_.urls = {group_.Url()};
  }

  // A recording that does not end is a failure, which ends the program.
  void SetUp() override { alarm(kPatienceSeconds); }
  void TearDown() override { alarm(0); }

  RecordingSession& Make() { return session_.emplace(settings_, clock_); }
  RecordingSession& MakeOpen() {
    RecordingSession& session = Make();
    const Result<> opened = session.Open();
    EXPECT_TRUE(opened) << ErrorText(opened);
    return session;
  }
  // Starts and stops: what has arrived is recorded.
  RecordingStatus RecordWhatArrived() {
    session_->Start();
    session_->Stop();
    return session_->status();
  }
  // Returns true as soon as it is so.
  template <typename Condition>
  [[nodiscard]] bool Waits(const Condition& condition) const {
    const SystemClock clock;
    const MonoNs end = clock.Now() + 30 * kSecond;  // generous: for a host that is busy with something else
    while (!condition()) {
      if (clock.Now() > end) return false;
      std::this_thread::yield();
    }
    return true;
  }
  [[nodiscard]] std::vector<std::uint8_t> Log() const {
    std::ifstream file(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  [[nodiscard]] std::string Source(const std::vector<LogEvent>& events) const {
    return WriteSource(folder_.path() + "/source.lcm", events);
  }

  TemporaryFolder folder_;
  std::string path_ = folder_.path() + "/a.lcm";
  TestGroup group_;
  TestSender sender_{group_};
  CountingClock clock_;
  RecordingSettings settings_;
  std::optional<RecordingSession> session_;
};

TEST_F(RecordingSessionTest, RecordsWhatArrivedBeforeTheStop) {
  RecordingSession& session = MakeOpen();
  EXPECT_THAT(session.warnings(), IsEmpty());
  EXPECT_TRUE(session.status().recording);
  EXPECT_EQ(session.status().disk.file, path_);
  for (const char* text : {"1", "2", "3"}) sender_.Send("A", text);
  const RecordingStatus status = RecordWhatArrived();
  EXPECT_THAT(MessagesIn(Log()), ElementsAre("A=1", "A=2", "A=3"));
  EXPECT_FALSE(status.recording);
  EXPECT_EQ(status.messages, 3);
  EXPECT_EQ(status.bytes, static_cast<std::int64_t>(Log().size()));
  EXPECT_EQ(status.disk.file_bytes, status.bytes);
  EXPECT_EQ(status.receiver.received, 3);
  EXPECT_EQ(status.unwritten, 0);
  EXPECT_EQ(status.failure, "");
  EXPECT_THAT(status.channels, IsEmpty());
  EXPECT_TRUE(status.IsComplete());
  EXPECT_FALSE(status.HasFailed());
}

// Batches that come within 0.5 ms are written together; here no time passes between them.
TEST_F(RecordingSessionTest, RecordsAlsoIfItsClockDoesNotRun) {
  const FakeClock still;
  RecordingSession session(settings_, still);
  ASSERT_TRUE(session.Open());
  sender_.Send("A", "1");
  session.Start();
  session.Stop();
  EXPECT_THAT(MessagesIn(Log()), ElementsAre("A=1"));
}

TEST_F(RecordingSessionTest, RecordsWhileItRuns) {
  RecordingSession& session = MakeOpen();
  session.Start();
  for (int i = 1; i <= 3; ++i) {
    sender_.Send("A", std::to_string(i));
    EXPECT_TRUE(Waits([&] { return session.status().messages == i; }));
    EXPECT_TRUE(Waits([&] { return static_cast<int>(MessagesIn(Log()).size()) == i; }));
  }
  EXPECT_TRUE(Waits([&] { return session.HasProgress(); }));
  session.Stop();
  static_cast<void>(session.HasProgress());
  EXPECT_FALSE(session.HasProgress());
}

TEST_F(RecordingSessionTest, WhatIsNotStoppedEndsWithItsObject) {
  MakeOpen().Start();
  sender_.Send("A", "1");
  session_.reset();
  const std::vector<std::uint8_t> log = Log();
  EXPECT_THAT(MessagesIn(log), ElementsAre("A=1"));
  EXPECT_EQ(FindTail(log).open.seal().events, 0U) << "it is sealed";
}

TEST_F(RecordingSessionTest, ContinuesALog) {
  MakeOpen();
  sender_.Send("A", "1");
  RecordWhatArrived();
  const std::vector<std::uint8_t> before = Log();
  std::ofstream(path_, std::ios::binary | std::ios::app) << "torn";
  Make().Append(FindTail(before));
  ASSERT_TRUE(session_->Open());
  sender_.Send("A", "2");
  RecordWhatArrived();
  EXPECT_THAT(MessagesIn(Log()), ElementsAre("A=1", "A=2"));
}

TEST_F(RecordingSessionTest, ASourceThatCannotBeOpenedIsAnError) {
  settings_.urls = {group_.Url(), "udpm://10.0.0.1:7667"};
  EXPECT_THAT(ErrorText(Make().Open()), HasSubstr("10.0.0.1"));
  EXPECT_FALSE(std::filesystem::exists(path_));
}

TEST_F(RecordingSessionTest, ALogThatCannotBeOpenedIsAnError) {
  settings_.writer.file = folder_.path() + "/none/a.lcm";
  EXPECT_THAT(ErrorText(Make().Open()),
              HasSubstr("/none/a.lcm: No such file or directory; create the folder first"));
}

TEST_F(RecordingSessionTest, ASourceThatFailsEndsTheReceptionNotTheLog) {
  const std::string url = Source({MessageOf("A", "1", 0)});
  settings_.urls = {url};
  RecordingSession& session = MakeOpen();
  session.Start();
  EXPECT_TRUE(Waits([&] { return !session.status().failure.empty(); }));
  session.Stop();
  EXPECT_EQ(session.status().failure, "LCM failed on " + url + ": start its server, and record again");
  EXPECT_TRUE(session.status().HasFailed());
  EXPECT_THAT(MessagesIn(Log()), ElementsAre("A=1"));
}

TEST_F(RecordingSessionTest, ReportsTheLossesOfItsChannels) {
  MakeOpen();
  for (const std::int64_t seq : {1, 5}) {
    position_t message{};
    message.boot_id = 1;
    message.seq = seq;
    sender_.Send("POSITION/axis1", AsText(Encoded(message)));
  }
  const RecordingStatus status = RecordWhatArrived();
  ASSERT_THAT(status.channels, SizeIs(1));
  EXPECT_EQ(status.channels[0].lost, 3);
}

TEST_F(RecordingSessionTest, ALogEndsAfterItsTriggerWithoutAnotherMessage) {
  settings_.recorder.pre_trigger = PreTrigger{std::regex("^ESTOP"), 10 * kSecond, 50 * kMillisecond, 500};
  const std::string text(1'000, 'x');
  settings_.urls = {Source({MessageOf("A", text, 0), MessageOf("ESTOP", "!", 0), MessageOf("A", "", kMuchLater)})};
  RecordingSession& session = MakeOpen();
  EXPECT_FALSE(session.status().recording);
  session.Start();
  EXPECT_TRUE(Waits([&] { return session.status().messages == 1; }));
  EXPECT_EQ(session.status().early, 1);
  const std::int64_t before = clock_.readings();
  EXPECT_TRUE(Waits([this] { return !LogFile::IsBeingWritten(path_); }));
  EXPECT_LT(clock_.readings() - before, 1'000) << "it waits";
  EXPECT_FALSE(session.status().recording);
  EXPECT_THAT(MessagesIn(Log()), ElementsAre("ESTOP=!"));
}

TEST_F(RecordingSessionTest, WhatIsReceivedIsSealedWithoutAnotherMessage) {
  settings_.urls = {Source({MessageOf("A", "1", 0), MessageOf("A", "", kMuchLater)})};
  MakeOpen().Start();
  const auto is_sealed = [this] {
    const std::vector<std::uint8_t> log = Log();
    return MessagesIn(log).size() == 1 && FindTail(log).open.seal().events == 0;
  };
  EXPECT_TRUE(Waits(is_sealed));
  EXPECT_LT(clock_.readings(), 1'000) << "it waits";
}

TEST_F(RecordingSessionTest, WhatTheDiskDoesNotTakeIsUnwritten) {
  MakeOpen();
  for (const char* text : {"1", "2", "3"}) sender_.Send("A", text);
  const FileSizeLimit limit(Log().size());
  const RecordingStatus status = RecordWhatArrived();
  EXPECT_EQ(status.unwritten, 3);
  EXPECT_EQ(status.messages, 0);
  EXPECT_EQ(status.Lost(), 3);
  EXPECT_EQ(status.disk.state, DiskState::kFailed);
  EXPECT_TRUE(status.HasFailed());
  EXPECT_THAT(MessagesIn(Log()), IsEmpty());
}

// Messages that are larger than what is written together: the disk blocks the recording in the middle of a batch.
class BlockedRecordingTest : public RecordingSessionTest {
 protected:
  static constexpr int kMessages = 10;
  static constexpr std::size_t kSize = 700'000;

  void SetUp() override {
    RecordingSessionTest::SetUp();
    const std::string text(kSize, 'x');
    std::vector<LogEvent> events(kMessages, MessageOf("A", text, 0));
    events.push_back(MessageOf("A", text, kMuchLater));
    settings_.urls = {Source(events)};
    MakeOpen();
  }
  [[nodiscard]] bool IsBlocked() const { return session_->status().disk.state == DiskState::kFailed; }
};

TEST_F(BlockedRecordingTest, AStopEndsTheWaitForTheDiskAndCountsWhatIsUnwritten) {
  const FileSizeLimit limit(Log().size());
  session_->Start();
  EXPECT_TRUE(Waits([&] { return session_->status().receiver.received == kMessages && IsBlocked(); }));
  session_->Stop();
  const RecordingStatus status = session_->status();
  EXPECT_EQ(status.unwritten, kMessages);
  EXPECT_EQ(status.messages, 0);
  EXPECT_THAT(MessagesIn(Log()), IsEmpty());
}

TEST_F(BlockedRecordingTest, WhatWaitsForTheDiskIsWrittenWhenItCanBe) {
  {
    const FileSizeLimit limit(Log().size());
    session_->Start();
    EXPECT_TRUE(Waits([&] { return session_->status().receiver.received == kMessages && IsBlocked(); }));
  }
  EXPECT_TRUE(Waits([&] { return session_->status().messages == kMessages && !IsBlocked(); }));
  session_->Stop();
  EXPECT_EQ(session_->status().unwritten, 0);
  EXPECT_THAT(MessagesIn(Log()), SizeIs(kMessages));
}

TEST_F(BlockedRecordingTest, WhatCameBeforeTheStopIsWrittenIfTheDiskIsFreeThen) {
  {
    const FileSizeLimit limit(Log().size());
    session_->Start();
    EXPECT_TRUE(Waits([&] { return session_->status().receiver.received == kMessages && IsBlocked(); }));
  }
  session_->Stop();
  const RecordingStatus status = session_->status();
  EXPECT_EQ(status.messages, kMessages);
  EXPECT_EQ(status.unwritten, 0);
  EXPECT_THAT(MessagesIn(Log()), SizeIs(kMessages));
}

// The queue is bounded, and the writer's memory is not.
TEST_F(BlockedRecordingTest, MessagesStayInTheQueueWhileTheDiskIsBlocked) {
  const FileSizeLimit limit(Log().size());
  session_->Start();
  EXPECT_TRUE(Waits([&] { return session_->status().receiver.received == kMessages && IsBlocked(); }));
  EXPECT_LT(session_->status().messages, kMessages / 2);
  session_->Stop();
}

TEST_F(RecordingSessionTest, ASingleMessageThatIsLeftIsCounted) {
  MakeOpen();
  const FileSizeLimit limit(Log().size());
  session_->Start();
  sender_.Send("A", "1");
  EXPECT_TRUE(Waits([&] { return session_->status().disk.state == DiskState::kFailed; }));
  sender_.Send("A", "2");
  EXPECT_TRUE(Waits([&] { return session_->status().receiver.received == 2; }));
  session_->Stop();
  EXPECT_EQ(session_->status().unwritten, 2);
}

}  // namespace
}  // namespace axlecast
