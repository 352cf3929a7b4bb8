#include "tools/axlecast/logs/log_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <axlecast/position_t.hpp>
#include <axlecast/recorder_health_t.hpp>

#include "core/base/inline_bytes.h"
#include "core/messages/json/field.h"
#include "core/messages/message.h"
#include "tools/log/log_event.h"

namespace axlecast {
namespace {

using testing::HasSubstr;
using Json = nlohmann::ordered_json;

constexpr std::int64_t kStart = 1'790'000'000'000'000;

std::vector<std::uint8_t> Position(std::int64_t boot_id, std::int64_t seq) {
  position_t position{};
  position.boot_id = boot_id;
  position.seq = seq;
  return Encoded(position);
}

Bytes BytesOf(std::string_view text) { return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}; }

TEST(LogSummary, CountsEachChannel) {
  LogSummary summary;
  for (std::int64_t i = 0; i < 11; ++i) {
    const std::int64_t utime = kStart + i * 100'000 + (i > 5 ? 2'000'000 : 0);
    summary.Add({.utime = utime, .channel = "POSITION/axis1", .data = Position(1, i)});
  }
  summary.Add({.utime = kStart, .channel = "OTHER", .data = BytesOf("xyz")});
  EXPECT_EQ(summary.events, 12);
  EXPECT_EQ(summary.last - summary.first, 3'000'000);
  const LogSummary::Channel& axis = summary.channels.at("POSITION/axis1");
  EXPECT_EQ(axis.type, "position_t");
  EXPECT_EQ(axis.count, 11);
  EXPECT_DOUBLE_EQ(axis.Hz(), 10 / 3.0);
  EXPECT_EQ(axis.largest_gap, 2'100'000);
  EXPECT_EQ(axis.gap_at, kStart + 500'000);
  EXPECT_EQ(axis.bytes, 11 * (28 + 14 + Position(1, 0).size()));
  const LogSummary::Channel& other = summary.channels.at("OTHER");
  EXPECT_EQ(other.type, "");
  EXPECT_EQ(other.Hz(), 0);
  EXPECT_EQ(summary.Lost(), 0);
}

TEST(LogSummary, CountsWhatIsMissingByPublisher) {
  LogSummary summary;
  for (const auto& [boot_id, seq] : {std::pair(1, 10), {1, 11}, {1, 15}, {2, 0}, {2, 2}}) {
    summary.Add({.utime = kStart, .channel = "POSITION/axis1", .data = Position(boot_id, seq)});
  }
  EXPECT_EQ(summary.Lost(), 3 + 1);
  const Json json = SummaryJson("f", 1, summary, {});
  EXPECT_EQ(json.at("channels").at(0).at("lost"), 4);
}

TEST(LogSummary, ShowsTheHeadOfTheLogAndWhatTheRecorderLost) {
  LogSummary summary;
  summary.Add(
      {.utime = kStart, .channel = kMachineChannel, .data = BytesOf("# ours\nmachine: press3 # the third\n")});
  summary.Add({.utime = kStart, .channel = kSchemaChannel, .data = BytesOf("package axlecast;")});
  summary.Add({.utime = kStart, .channel = kRecorderChannel, .data = BytesOf(R"({"version":"1"})")});
  recorder_health_t health{};
  health.messages = 90;
  health.lost = 12;
  health.n_senders = 2;
  health.senders = {{"10.0.0.1:5000", 50, 12}, {"10.0.0.2:5000", 40, 0}};
  summary.Add({.utime = kStart, .channel = "RECORDER/run", .data = Encoded(health)});
  const std::string text = SummaryText("f", 1'000, summary, {{10, 5}, {20, 7}});
  EXPECT_THAT(text, HasSubstr("machine   press3 (its file: 35 bytes)\n"));
  EXPECT_THAT(text, HasSubstr("schema    17 bytes"));
  EXPECT_THAT(text, HasSubstr("RECORDER/run: lost 12 of 90 messages"));
  EXPECT_THAT(text, HasSubstr("  10.0.0.1:5000: lost 12 of 50\n"));
  EXPECT_THAT(text, testing::Not(HasSubstr("10.0.0.2")));
  EXPECT_THAT(text, HasSubstr("damage    2 places, 12 bytes\n"));
  EXPECT_THAT(text, HasSubstr("f: 5 bytes from byte 10 on are damaged\n"));
  const Json json = SummaryJson("f", 1'000, summary, {{10, 5}});
  EXPECT_EQ(json.at("machine"), "press3");
  EXPECT_EQ(json.at("recorder").at("version"), "1");
  EXPECT_EQ(json.at("damage").dump(), R"([{"offset":10,"bytes":5}])");
}

TEST(LogSummary, HasTheNewestStatementOfARecorderAlsoWithAPrefix) {
  LogSummary summary;
  recorder_health_t health{};
  for (const std::int64_t lost : {0, 10}) {
    health.messages += 50;
    health.lost = lost;
    summary.Add({.utime = kStart, .channel = "press3.RECORDER/run", .data = Encoded(health)});
  }
  EXPECT_THAT(SummaryText("f", 1'000, summary, {}), HasSubstr("press3.RECORDER/run: lost 10 of 100 messages"));
}

TEST(LogSummary, StandsAnyTimes) {
  LogSummary summary;
  for (const std::int64_t utime : {INT64_MAX, INT64_MIN, std::int64_t{0}}) {
    summary.Add({.utime = utime, .channel = "A", .data = {}});
  }
  EXPECT_FALSE(SummaryText("f", 87, summary, {}).empty());
  EXPECT_FALSE(SummaryJson("f", 87, summary, {}).empty());
  EXPECT_THAT(SummaryText("f", 0, LogSummary(), {}), HasSubstr("events    0"));
}

TEST(LogLine, DecodesWhatIsOurs) {
  const auto data = Position(0x0A, 7);
  const Json line =
      Json::parse(EventLine({.number = 3, .utime = kStart, .channel = "POSITION/axis1", .data = data}, false));
  EXPECT_EQ(line.at("number"), 3);
  EXPECT_EQ(line.at("received_utime"), kStart);
  EXPECT_EQ(line.at("channel"), "POSITION/axis1");
  EXPECT_EQ(line.at("type"), "position_t");
  EXPECT_EQ(line.at("seq"), 7);
  EXPECT_FALSE(line.contains("data"));
}

TEST(LogLine, ShowsAllElseInHex) {
  EXPECT_EQ(EventLine({.number = 1, .utime = 2, .channel = "A", .data = BytesOf("\x01\xFF")}, false),
            "{\"number\":1,\"received_utime\":2,\"channel\":\"A\",\"size\":2,\"data\":\"01ff\"}\n");
  const auto data = Position(1, 1);
  EXPECT_EQ(Json::parse(EventLine({.channel = "POSITION/a", .data = data}, true)).at("data"), HexDigits(data));
}

TEST(LogLine, ShowsHeadersAndSeals) {
  EXPECT_EQ(Json::parse(EventLine({.channel = kMachineChannel, .data = BytesOf("machine: x")}, false)).at("text"),
            "machine: x");
  const auto seal = EncodeSeal({.bytes = 1, .events = 2, .crc32c = 3});
  const Json line = Json::parse(EventLine({.channel = kSealChannel, .data = seal}, false));
  EXPECT_EQ(line.at("events"), 2);
  EXPECT_EQ(line.at("crc32c"), 3);
}

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
