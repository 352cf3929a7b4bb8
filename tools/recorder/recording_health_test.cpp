#include "tools/recorder/recording_health.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>
#include <vector>

#include "core/messages/message.h"

namespace axlecast {
namespace {

RecordingStatus Status(std::int64_t messages) {
  RecordingStatus status;
  status.recording = true;
  status.messages = messages;
  status.bytes = messages * 100;
  return status;
}

TEST(RecordingHealth, TellsRatesLossesAndSenders) {
  RecordingHealth health("press3", Origin{.boot_id = 7});
  static_cast<void>(health.Make(Status(100), kSecond, 1, false));
  RecordingStatus status = Status(400);
  status.receiver.lost = 3;
  status.receiver.overflow = 2;
  status.receiver.kernel_dropped = 4;
  status.receiver.senders = {{SenderAddress::OfIPv4(0x7f000001, 40'001), 390, 5, 0}};
  status.disk.file = "/var/log/press3.lcm";
  const recorder_health_t made = health.Make(status, 3 * kSecond, 2, false);
  EXPECT_EQ(made.seq, 1);
  EXPECT_EQ(made.boot_id, 7);
  EXPECT_FLOAT_EQ(made.messages_hz, 150);
  EXPECT_FLOAT_EQ(made.bytes_hz, 15'000);
  EXPECT_EQ(made.lost, 5);
  EXPECT_EQ(made.kernel_dropped, 4);
  ASSERT_EQ(made.n_senders, 1);
  EXPECT_EQ(made.senders[0].sender, "127.0.0.1:40001");
  EXPECT_EQ(made.senders[0].lost, 5);
  EXPECT_EQ(made.file, "/var/log/press3.lcm");
  EXPECT_EQ(made.state, recorder_health_t::STATE_RECORDING);
}

TEST(RecordingHealth, RepeatsTheStatusWithItsTimes) {
  RecordingHealth health("press3", Origin{.boot_id = 7});
  RecordingStatus status = Status(100);
  status.unwritten = 6;
  status.receiver.senders = {{SenderAddress::OfIPv4(0x7f000001, 40'001), 390, 5, 0}};
  status.disk.file_bytes = 300;
  status.disk.free_bytes = 400;
  status.disk.last_error = "disk full";
  status.disk.last_error_utime = 500;
  const recorder_health_t made = health.Make(status, 7 * kSecond, 8, false);
  EXPECT_EQ(made.utime, 8);
  EXPECT_EQ(made.mono_ns, 7 * kSecond);
  EXPECT_EQ(made.name, "press3");
  EXPECT_EQ(made.file_bytes, 300);
  EXPECT_EQ(made.total_bytes, 10'000);
  EXPECT_EQ(made.messages, 100);
  EXPECT_EQ(made.lost, 6);
  EXPECT_EQ(made.free_bytes, 400);
  EXPECT_EQ(made.senders.at(0).received, 390);
  EXPECT_EQ(made.last_error, "disk full");
  EXPECT_EQ(made.last_error_utime, 500);
}

TEST(RecordingHealth, SpaceThatIsUnknownIsZero) {
  RecordingHealth health("m", Origin{.boot_id = 7});
  EXPECT_EQ(health.Make(Status(1), kSecond, 1, false).free_bytes, 0);
}

TEST(RecordingHealth, ThereIsNoRateWithoutATimeBefore) {
  RecordingHealth health("m", Origin{.boot_id = 7});
  EXPECT_EQ(health.Make(Status(100), kSecond, 1, false).messages_hz, 0) << "the first";
  EXPECT_EQ(health.Make(Status(200), kSecond, 1, false).messages_hz, 0) << "at the same time";
  EXPECT_EQ(health.Make(Status(300), kSecond - 1, 1, false).messages_hz, 0) << "the time ran back";
  RecordingHealth early("m", Origin{.boot_id = 7});
  static_cast<void>(early.Make(Status(0), 1, 1, false));
  EXPECT_FLOAT_EQ(early.Make(Status(100), 1 + kSecond, 1, false).messages_hz, 100);
}

TEST(RecordingHealth, OfALongPathTheEndIsReported) {
  RecordingHealth health("m", Origin{.boot_id = 7});
  RecordingStatus status = Status(1);
  status.disk.file = "/" + std::string(199, 'x');
  EXPECT_EQ(health.Make(status, kSecond, 1, false).file, status.disk.file);
  status.disk.file = "/" + std::string(200, 'x');
  EXPECT_EQ(health.Make(status, kSecond, 1, false).file, std::string(200, 'x'));
}

TEST(RecordingHealth, MoreSendersThanTheirCountCanHoldAreTheLargestCount) {
  RecordingHealth health("m", Origin{.boot_id = 7});
  RecordingStatus status = Status(1);
  status.receiver.senders.resize(40'000);
  EXPECT_EQ(health.Make(status, kSecond, 1, false).total_senders, 32'767);
}

TEST(RecordingHealth, TellsWhatIsWrong) {
  RecordingHealth health("m", Origin{.boot_id = 7});
  const auto state_of = [&](const RecordingStatus& status, bool stopping = false) {
    return static_cast<int>(health.Make(status, kSecond, 1, stopping).state);
  };
  RecordingStatus status = Status(1);
  EXPECT_EQ(state_of(status, true), recorder_health_t::STATE_STOPPING);
  status.recording = false;
  EXPECT_EQ(state_of(status), recorder_health_t::STATE_PRE_TRIGGER);
  status.disk.state = DiskState::kFull;
  EXPECT_EQ(state_of(status, true), recorder_health_t::STATE_DISK_FULL);
  status.disk.damaged = true;
  EXPECT_EQ(state_of(status), recorder_health_t::STATE_ERROR);
}

TEST(RecordingHealth, EveryFailureIsAnError) {
  RecordingHealth health("m", Origin{.boot_id = 7});
  const auto is_error = [&](const RecordingStatus& status) {
    return health.Make(status, kSecond, 1, false).state == recorder_health_t::STATE_ERROR;
  };
  RecordingStatus status = Status(1);
  status.unwritten = 1;
  EXPECT_TRUE(is_error(status));
  status = Status(1);
  status.failure = "LCM failed";
  EXPECT_TRUE(is_error(status));
  status = Status(1);
  status.disk.state = DiskState::kFailed;
  EXPECT_TRUE(is_error(status));
}

TEST(RecordingStatus, IsCompleteIfNothingWasLostOrDropped) {
  RecordingStatus status = Status(1);
  EXPECT_TRUE(status.IsComplete());
  status.receiver.kernel_dropped = 1;
  EXPECT_FALSE(status.IsComplete());
  status = Status(1);
  for (std::int64_t* lost : {&status.receiver.lost, &status.receiver.overflow, &status.unwritten}) {
    *lost = 1;
    EXPECT_EQ(status.Lost(), 1);
    EXPECT_FALSE(status.IsComplete());
    *lost = 0;
  }
}

TEST(RecordingHealth, AlwaysFitsADatagram) {
  RecordingHealth health(std::string(24, 'n'), Origin{.boot_id = 7});
  RecordingStatus status = Status(1);
  status.disk.file = std::string(4'000, '/');
  status.disk.last_error = std::string(4'000, 'e');
  for (std::uint16_t i = 0; i < 1'000; ++i) {
    status.receiver.senders.push_back({SenderAddress::OfIPv4(0xffffffff, 65'535), 1, 1, 1});
  }
  recorder_health_t made = health.Make(status, kSecond, 1, false);
  EXPECT_EQ(made.n_senders, 16);
  EXPECT_EQ(made.total_senders, 1'000);
  EXPECT_EQ(made.file.size(), 200U);
  EXPECT_LE(made.getEncodedSize(), kMaxMessage);
  for (SenderCount& sender : status.receiver.senders) sender.sender.address.fill(0xfd);
  made = health.Make(status, kSecond, 1, false);
  EXPECT_GT(made.n_senders, 8);
  EXPECT_EQ(static_cast<std::size_t>(made.n_senders), made.senders.size());
  EXPECT_EQ(made.total_senders, 1'000);
  EXPECT_LE(made.getEncodedSize(), kMaxMessage) << "an IPv6 address has twice the length";
}

TEST(RecordingHealth, OneSenderIsRemovedForTheSpaceThatANameTakes) {
  RecordingStatus status = Status(1);
  status.receiver.senders = {{SenderAddress::OfIPv4(0x7f000001, 40'001), 390, 5, 0}};
  RecordingHealth short_name("m", Origin{.boot_id = 7});
  const auto size = static_cast<std::size_t>(short_name.Make(status, kSecond, 1, false).getEncodedSize());
  const auto senders_with_name_of = [&status](std::size_t length) {
    RecordingHealth health(std::string(length, 'm'), Origin{.boot_id = 7});
    const recorder_health_t made = health.Make(status, kSecond, 1, false);
    EXPECT_EQ(made.n_senders, static_cast<int>(made.senders.size()));
    return static_cast<int>(made.n_senders);
  };
  EXPECT_EQ(senders_with_name_of(kMaxMessage - size + 1), 1) << "it fits exactly";
  EXPECT_EQ(senders_with_name_of(kMaxMessage - size + 2), 0);
  EXPECT_EQ(senders_with_name_of(kMaxMessage), 0);
}

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class RecordingAlarmsTest : public ::testing::Test {
 protected:
  // "name state" of each, worst first.
  std::vector<std::string> Alarms() {
    ++now_;
    const alarm_t& message = alarms_.Make(status_, now_ * kSecond, now_);
    EXPECT_EQ(message.device, "recorder/positions");
    std::vector<std::string> texts;
    for (const alarm_entry_t& entry : message.entries) {
      texts.push_back(entry.name + (entry.state == alarm_entry_t::STATE_LIVE ? " live" : " latched"));
    }
    return texts;
  }

  RecordingStatus status_;
  RecordingAlarms alarms_{"positions", Origin{.boot_id = 7}};
  std::int64_t now_ = 0;
};

TEST_F(RecordingAlarmsTest, ThereIsNoneWhileAllIsWell) {
  EXPECT_THAT(Alarms(), IsEmpty());
  const alarm_t& message = alarms_.Make(status_, kSecond, 2);
  EXPECT_EQ(message.boot_id, 7);
  EXPECT_EQ(message.seq, 1);
}

TEST_F(RecordingAlarmsTest, AFullDiskIsOneUntilItHasRoom) {
  status_.disk.state = DiskState::kFull;
  EXPECT_THAT(Alarms(), ElementsAre("disk_full live"));
  status_.disk.state = DiskState::kGood;
  EXPECT_THAT(Alarms(), IsEmpty());
}

TEST_F(RecordingAlarmsTest, WhatTheDiskDidNotKeepIsNeverGood) {
  status_.disk.state = DiskState::kFailed;
  EXPECT_THAT(Alarms(), ElementsAre("disk_fails live"));
  status_.disk.state = DiskState::kGood;
  EXPECT_THAT(Alarms(), IsEmpty());
  status_.disk.damaged = true;
  EXPECT_THAT(Alarms(), ElementsAre("disk_fails latched"));
}

TEST_F(RecordingAlarmsTest, LossesAreLiveWhileTheyGrowAndStay) {
  status_.receiver.lost = 1;
  EXPECT_THAT(Alarms(), ElementsAre("messages_lost live"));
  EXPECT_THAT(Alarms(), ElementsAre("messages_lost latched"));
  status_.receiver.kernel_dropped = 5;
  EXPECT_THAT(Alarms(), ElementsAre("messages_lost live"));
  status_.receiver.lost = 5;
  EXPECT_THAT(Alarms(), ElementsAre("messages_lost latched")) << "the gaps of those drops";
}

TEST_F(RecordingAlarmsTest, LogsThatWaitForTheShipper) {
  status_.disk.closed.held_logs = 2;
  EXPECT_THAT(Alarms(), ElementsAre("logs_not_shipped live"));
  status_.disk.closed.deleted_unshipped = 1;
  EXPECT_THAT(Alarms(), ElementsAre("log_deleted_unshipped live", "logs_not_shipped live"));
  status_.disk.closed.held_logs = 0;
  EXPECT_THAT(Alarms(), ElementsAre("log_deleted_unshipped latched"));
  const alarm_t& message = alarms_.Make(status_, kSecond, 2);
  EXPECT_EQ(message.entries.at(0).severity, alarm_entry_t::SEVERITY_ERROR);
  EXPECT_EQ(message.entries.at(0).code, 404);
  status_.disk.closed.deleted_unshipped = 2;
  EXPECT_THAT(Alarms(), ElementsAre("log_deleted_unshipped live"));
}

}  // namespace

}  // namespace axlecast
