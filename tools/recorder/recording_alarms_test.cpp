#include "tools/recorder/recording_alarms.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace axlecast {
namespace {

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
  RecordingAlarms alarms_{"positions", 7};
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
  status_.intake.lost = 1;
  EXPECT_THAT(Alarms(), ElementsAre("messages_lost live"));
  EXPECT_THAT(Alarms(), ElementsAre("messages_lost latched"));
  status_.intake.kernel_dropped = 5;
  EXPECT_THAT(Alarms(), ElementsAre("messages_lost live"));
  status_.intake.lost = 5;
  EXPECT_THAT(Alarms(), ElementsAre("messages_lost latched")) << "the gaps of those drops";
}

}  // namespace
}  // namespace axlecast
