#include "tools/axlecast/logs/log_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/inline_bytes.h"

namespace axlecast {
namespace {

using testing::HasSubstr;
using testing::SizeIs;

// A check of events that a test numbers and stamps.
class LogCheckTest : public testing::Test {
 protected:
  void Add(std::int64_t number, std::int64_t utime = 0, std::string_view channel = "A", Bytes data = {}) {
    std::vector<std::uint8_t> record;
    const LogEvent event{.number = number, .utime = utime, .channel = channel, .data = data};
    AppendEvent(record, event);
    if (channel != kSealChannel) count_.Add(record);
    check_.Add(event, offset_, record);
    offset_ += record.size();
  }
  void AddSeal(std::int64_t number, const LogSeal& seal) {
    Add(number, 0, kSealChannel, EncodeSeal(seal));
    count_.Reset();
  }
  void AddNumbers(const std::vector<std::int64_t>& numbers) {
    for (const std::int64_t number : numbers) Add(number);
  }

  const LogCheck::Report& Report() { return check_.Finish(); }

  LogCheck check_;
  SealCount count_;  // as a recorder counts
  std::size_t offset_ = 0;
};

TEST_F(LogCheckTest, ALogInOrderIsSound) {
  AddNumbers({0, 1, 2, 3});
  EXPECT_TRUE(Report().IsSound());
  EXPECT_EQ(Report().events, 4);
  EXPECT_EQ(CheckText("f", Report(), {}), "f: 4 events, no seals: changed content cannot be detected; complete\n");
}

TEST_F(LogCheckTest, EventsThatAreMissingAreCounted) {
  AddNumbers({0, 1, 4, 5, 9, 12, 13});
  EXPECT_EQ(Report().missing, 2 + 3 + 2);
  EXPECT_EQ(Report().wrong_numbers, 0);
  EXPECT_FALSE(Report().IsSound());
}

TEST_F(LogCheckTest, MissingBeforeTheLast) {
  AddNumbers({0, 1, 4});
  EXPECT_EQ(Report().missing, 2);
}

TEST_F(LogCheckTest, ADamagedNumberIsNoMissingEvent) {
  for (const std::int64_t wrong :
       {INT64_MIN, std::int64_t{-1}, std::int64_t{0}, std::int64_t{1} << 56U, INT64_MAX}) {
    check_ = {};
    AddNumbers({0, 1, wrong, 3, 4});
    EXPECT_EQ(Report().missing, 0) << wrong;
    EXPECT_EQ(Report().wrong_numbers, 1) << wrong;
    EXPECT_EQ(Report().restarts, 0) << wrong;
  }
}

TEST_F(LogCheckTest, NumbersThatBeginAnewAreToldOnly) {
  AddNumbers({0, 1, 2, 0, 1, 2, 3});
  EXPECT_EQ(Report().restarts, 1);
  EXPECT_TRUE(Report().IsSound());
  EXPECT_THAT(CheckText("f", Report(), {}), HasSubstr("begin again"));
}

TEST_F(LogCheckTest, TimesThatRunBackAreToldOnly) {
  Add(0, 1'000'000);
  Add(1, 999'000);
  Add(2, 2'000'000);
  Add(3, INT64_MIN);
  EXPECT_EQ(Report().backward, 1) << "the last difference is beyond any number";
  EXPECT_EQ(Report().max_backward_us, 1'000);
  EXPECT_TRUE(Report().IsSound());
}

TEST_F(LogCheckTest, SealsThatMatch) {
  Add(0);
  Add(1, 5, "B");
  AddSeal(2, count_.seal());
  AddSeal(3, {});
  Add(4);
  EXPECT_EQ(Report().seals, 2);
  EXPECT_EQ(Report().bad_seals, 0);
  EXPECT_EQ(Report().unsealed, 1);
  EXPECT_TRUE(Report().IsSound());
}

TEST_F(LogCheckTest, AChangedByteAMissingAndAnAddedEventAreTold) {
  Add(0);
  LogSeal seal = count_.seal();
  seal.crc32c ^= 1;
  AddSeal(1, seal);
  Add(2);
  seal = count_.seal();
  seal.events += 2;
  AddSeal(3, seal);
  Add(4);
  AddSeal(5, {});
  Add(6);
  Add(7, 0, kSealChannel, {});  // none
  EXPECT_EQ(Report().bad_seals, 4);
  ASSERT_THAT(Report().first_bad_seals, SizeIs(4));
  const std::string text = CheckText("f", Report(), {});
  EXPECT_THAT(text,
              HasSubstr("the seal at byte 29 does not match: something in the 1 events before it was changed\n"));
  EXPECT_THAT(text, HasSubstr("2 of 3 events before it are missing\n"));
  EXPECT_THAT(text, HasSubstr("1 events too many are before it\n"));
  EXPECT_THAT(text, HasSubstr("0 of 4 seals match, 0 events are after the last one; readable with losses\n"));
}

TEST_F(LogCheckTest, ASealAfterDamageStillBeginsTheNextStretch) {
  Add(0);
  AddSeal(1, {.bytes = 1'000, .events = 10, .crc32c = 7});
  Add(2);
  AddSeal(3, count_.seal());
  EXPECT_EQ(Report().bad_seals, 1);
}

}  // namespace
}  // namespace axlecast
