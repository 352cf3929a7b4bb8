#include "tools/foxglove/foxglove_viewer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class FoxgloveViewerTest : public ::testing::Test {
 protected:
  void Message(std::uint32_t channel, std::string payload, bool kept = false) {
    viewer_.Add(channel, 1, std::make_shared<const std::string>(std::move(payload)), kept);
  }
  // Returns the frames that wait: texts as they are, of messages the subscription and the payload.
  [[nodiscard]] std::vector<std::string> Frames(MonoNs now = 0) {
    std::vector<std::string> frames;
    while (const auto frame = viewer_.Next(now)) {
      frames.push_back(frame->binary ? std::to_string(frame->text[1]) + ' ' + frame->text.substr(13) : frame->text);
    }
    return frames;
  }

  FoxgloveViewer viewer_;
};

TEST_F(FoxgloveViewerTest, AMessageGoesToEachSubscriptionOfItsChannel) {
  EXPECT_TRUE(viewer_.Subscribe({.subscription = 5, .channel = 1}, true));
  EXPECT_TRUE(viewer_.Subscribe({.subscription = 6, .channel = 1}, true));
  Message(1, "a");
  Message(2, "b");
  viewer_.Add("text");
  EXPECT_THAT(Frames(), ElementsAre("text", "5 a", "6 a"));
  EXPECT_TRUE(viewer_.Unsubscribe(5));
  Message(1, "c");
  EXPECT_THAT(Frames(), ElementsAre("6 c"));
  viewer_.Forget(1);
  EXPECT_FALSE(viewer_.IsSubscribed(1));
  EXPECT_EQ(ErrorText(viewer_.Unsubscribe(6)), "there is no subscription 6");
}

TEST_F(FoxgloveViewerTest, SubscriptionsThatAreNotPossibleAreReported) {
  EXPECT_THAT(ErrorText(viewer_.Subscribe({.subscription = 5, .channel = 1}, false)),
              HasSubstr("channel 1 is not advertised"));
  EXPECT_TRUE(viewer_.Subscribe({.subscription = 5, .channel = 2}, true));
  EXPECT_THAT(ErrorText(viewer_.Subscribe({.subscription = 5, .channel = 3}, true)), HasSubstr("in use"));
  for (std::uint32_t i = 1; i < FoxgloveViewer::kMaxSubscriptions; ++i)
    EXPECT_TRUE(viewer_.Subscribe({.subscription = 5 + i, .channel = 2}, true));
  EXPECT_THAT(ErrorText(viewer_.Subscribe({.subscription = 1, .channel = 2}, true)), HasSubstr("more than 10000"));
}

TEST_F(FoxgloveViewerTest, ASlowViewerLosesTheOldestMessagesAndNoAlarms) {
  ASSERT_TRUE(viewer_.Subscribe({.subscription = 1, .channel = 1}, true));
  ASSERT_TRUE(viewer_.Subscribe({.subscription = 2, .channel = 2}, true));
  Message(2, "alarm", true);
  for (int i = 0; i < 10; ++i) Message(1, std::string(1 << 20, static_cast<char>('0' + i)));
  EXPECT_EQ(viewer_.dropped(), 3);
  const std::vector<std::string> frames = Frames(kSecond);
  ASSERT_EQ(frames.size(), 9U);
  EXPECT_THAT(frames[0], HasSubstr("3 messages were dropped"));
  EXPECT_EQ(frames[1], "2 alarm");
  EXPECT_EQ(frames[2][2], '3');
  EXPECT_THAT(Frames(kSecond), IsEmpty());
}

TEST_F(FoxgloveViewerTest, AlarmsAreDroppedOnlyWithoutOtherMessages) {
  ASSERT_TRUE(viewer_.Subscribe({.subscription = 1, .channel = 1}, true));
  for (int i = 0; i < 10; ++i) Message(1, std::string(1 << 20, static_cast<char>('0' + i)), true);
  EXPECT_EQ(viewer_.dropped(), 3);
}

TEST_F(FoxgloveViewerTest, WhatWasDroppedIsReportedOnceASecond) {
  ASSERT_TRUE(viewer_.Subscribe({.subscription = 1, .channel = 1}, true));
  const std::string large(FoxgloveViewer::kMaxWaiting, 'x');
  Message(1, large);
  EXPECT_THAT(Frames(kSecond), ElementsAre(HasSubstr("\"1 messages were dropped")));
  Message(1, large);
  EXPECT_THAT(Frames(2 * kSecond - 1), IsEmpty());
  EXPECT_THAT(Frames(2 * kSecond), ElementsAre(HasSubstr("\"2 messages were dropped")));
}

TEST_F(FoxgloveViewerTest, AViewerThatReadsNothingIsStuck) {
  for (int i = 0; i < 33; ++i) viewer_.Add(std::string(1 << 20, 'x'));
  EXPECT_TRUE(viewer_.is_stuck());
  static_cast<void>(viewer_.Next(0));
  EXPECT_FALSE(viewer_.is_stuck());
}

}  // namespace
}  // namespace axlecast
