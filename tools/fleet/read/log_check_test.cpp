#include "tools/fleet/read/log_check.h"

#include <gmock/gmock.h>

#include <axlecast/position_block_t.hpp>
#include <axlecast/position_t.hpp>
#include <vector>

#include "core/messages/message.h"
#include "tools/log/log_fixture.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr std::int64_t kUtime = 1'795'244'400'000'000;  // begin of a minute

position_t PositionOf(int i) {
  position_t message{};
  message.utime = kUtime + i * 4'000LL;
  message.boot_id = 1;
  message.seq = i;
  message.counts = 10 * i;
  message.flags = position_t::FLAG_VALID;
  return message;
}

// A log of positions of axis1, and what the database has of it if everything is right.
class LogCheckTest : public ::testing::Test {
 protected:
  void AddMessage(std::string channel, std::vector<std::uint8_t> data) {
    events_.push_back({std::move(channel), std::move(data)});
  }
  void AddPositions(int begin, int end) {
    for (int i = begin; i < end; ++i) {
      AddMessage("press.POSITION/axis1", Encoded(PositionOf(i)));
      AddToDatabase(PositionOf(i));
    }
  }
  void AddToDatabase(const position_t& message) {
    DatabasePositions& positions = database_["axis1"];
    ++positions.samples;
    positions.digest.Add(message.utime, message.counts, message.flags);
  }
  void AddSeal() { AddMessage(std::string(kSealChannel), EncodeSeal({.bytes = 10, .events = 2, .crc32c = 3})); }

  // The ledger of the log up to the event.
  void Ship(std::int64_t upto) {
    ledger_.upto = upto;
    LogDigest digest(upto, "", {});
    Read(digest);
    ledger_.bytes = static_cast<std::int64_t>(digest.bytes());
    ledger_.chain = digest.chain();
  }
  template <typename Digest>
  void Read(Digest& digest) const {
    std::size_t end = 0;
    std::int64_t number = 0;
    for (const auto& [channel, data] : events_) {
      const LogEvent event{.number = number++, .utime = kUtime, .channel = channel, .data = data};
      digest.Add(event, end += EventSize(event));
    }
  }
  [[nodiscard]] LogComparison Compared(bool complete = false, std::vector<OddEvent> odd = {}) const {
    LogDigest digest(ledger_.upto, "press.", std::move(odd));
    Read(digest);
    return Compare({.log = digest,
                    .ledger = ledger_,
                    .database = database_,
                    .details = details_,
                    .content = true,
                    .complete = complete});
  }

  FleetLog ledger_;
  DatabaseDevices database_;
  std::map<std::string, Detail> details_ = {{"axis1", Detail::kSamples}};
  std::vector<std::pair<std::string, std::vector<std::uint8_t>>> events_;
};

TEST_F(LogCheckTest, IsEqual) {
  AddPositions(0, 100);
  AddSeal();
  Ship(101);
  EXPECT_THAT(Compared().differences, IsEmpty());
  EXPECT_EQ(Compared().events, 101);
  ASSERT_THAT(Compared().devices, SizeIs(1));
  EXPECT_EQ(Compared().devices[0].in_database, 100);
  EXPECT_THAT(ComparisonText("a.lcm", Compared()), HasSubstr("a.lcm: equal, 101 events"));
}

TEST_F(LogCheckTest, ComparesUpToWhatWasShipped) {
  AddPositions(0, 100);
  AddSeal();
  Ship(101);
  AddMessage("press.POSITION/axis1", Encoded(PositionOf(100)));
  EXPECT_THAT(Compared().differences, IsEmpty());
  EXPECT_EQ(Compared().remaining, 1);
  EXPECT_THAT(Compared(true).differences, ElementsAre("1 events are not in the database yet"));
}

TEST_F(LogCheckTest, FindsAMissingSample) {
  AddPositions(0, 100);
  Ship(100);
  database_["axis1"] = {};
  for (int i = 0; i < 100; ++i) {
    if (i != 50) AddToDatabase(PositionOf(i));
  }
  EXPECT_THAT(Compared().differences,
              ElementsAre("axis1, samples: the log has 100, the database 99",
                          "axis1, minute 2026-11-21 07:00:00: the log has 100 samples, the database 99"));
}

TEST_F(LogCheckTest, FindsASampleWithAnotherValue) {
  for (const auto& change : std::vector<std::function<void(position_t&)>>{
           [](position_t& message) { ++message.utime; }, [](position_t& message) { ++message.counts; },
           [](position_t& message) { message.flags = 0; }}) {
    events_.clear();
    database_.clear();
    AddPositions(0, 100);
    Ship(100);
    database_.clear();
    for (int i = 0; i < 100; ++i) {
      position_t message = PositionOf(i);
      if (i == 50) change(message);
      AddToDatabase(message);
    }
    EXPECT_THAT(Compared().differences, ElementsAre(HasSubstr("with other values")));
  }
}

TEST_F(LogCheckTest, FindsAnotherLedger) {
  AddPositions(0, 10);
  AddSeal();
  Ship(11);
  ledger_.chain ^= 1;
  EXPECT_THAT(Compared().differences, ElementsAre(HasSubstr("CRC-32C of the seals")));
  Ship(11);
  ++ledger_.bytes;
  EXPECT_THAT(Compared().differences, ElementsAre(HasSubstr("bytes")));
  Ship(12);
  EXPECT_THAT(Compared().differences, ElementsAre("number of the last event: the log has 11, the database 12"));
}

TEST_F(LogCheckTest, CountsARepeatedMessageOnce) {
  AddPositions(0, 10);
  AddMessage("press.POSITION/axis1", Encoded(PositionOf(9)));
  Ship(11);
  EXPECT_THAT(Compared().differences, IsEmpty());
}

TEST_F(LogCheckTest, TakesBlocksIfTheDatabaseHasThem) {
  position_block_t block{};
  block.boot_id = 1;
  block.utime = kUtime;
  block.n = 2;
  block.dt_ns = {0, 1'000'500};
  block.time_uncertainty_ns = {0, 0};
  block.counts = {5, 6};
  block.flags = {1, 1};
  AddMessage("press.POSITION_BLOCK/axis1", Encoded(block));
  AddMessage("press.POSITION/axis1", Encoded(PositionOf(0)));
  Ship(2);
  database_["axis1"].samples = 2;
  database_["axis1"].digest.Add(kUtime, 5, 1);
  database_["axis1"].digest.Add(kUtime + 1'000, 6, 1);
  EXPECT_THAT(Compared().differences, IsEmpty());
}

TEST_F(LogCheckTest, AcceptsWhatIsNotShippedWhole) {
  AddPositions(0, 10);
  Ship(10);
  database_["axis1"] = {};
  AddToDatabase(PositionOf(0));
  details_["axis1"] = Detail::kDeadband;
  EXPECT_THAT(Compared().differences, IsEmpty());
  details_["axis1"] = Detail::kNone;
  EXPECT_THAT(Compared().differences, ElementsAre("axis1, samples from this log: the log has 0, the database 1"));
}

TEST_F(LogCheckTest, ComparesOddMessages) {
  AddPositions(0, 10);
  AddMessage("press.POSITION/axis1", Encoded(PositionOf(-1)));
  Ship(11);
  const std::uint32_t crc = Crc32c(0, events_.back().second);
  EXPECT_THAT(Compared(false, {{10, crc}}).differences, IsEmpty());
  EXPECT_THAT(Compared(false, {{10, crc ^ 1}}).differences, ElementsAre(HasSubstr("odd messages")));
  EXPECT_THAT(Compared(false, {{10, crc}, {11, crc}}).differences, ElementsAre(HasSubstr("odd messages")));
}

TEST_F(LogCheckTest, ReportsChunksThatCannotBeDecoded) {
  AddPositions(0, 10);
  Ship(10);
  database_["axis1"].damaged = 1;
  EXPECT_THAT(Compared().differences, ElementsAre(HasSubstr("cannot be decoded")));
  EXPECT_EQ(ComparisonJson("a.lcm", Compared()).at("equal"), false);
}

// Five stretches of ten positions with their seals. Stretch k has the events 11 k to 11 k + 10.
std::vector<std::uint8_t> SealedLog() {
  ScriptedLog log;
  std::size_t sealed = 0;
  for (int i = 0; i < 50; ++i) {
    log.Add("press.POSITION/axis1", Encoded(PositionOf(i)));
    if (i % 10 != 9) continue;
    const Bytes open = Bytes(log.bytes()).subspan(sealed);
    log.Add(kSealChannel, EncodeSeal({.bytes = open.size(), .events = 10, .crc32c = Crc32c(0, open)}));
    sealed = log.bytes().size();
  }
  return log.bytes();
}

TEST(LogDigest, DamagedStretchesThatAreHolesDoNotCount) {
  std::vector<std::uint8_t> log = SealedLog();
  LogDigest intact(INT64_MAX, "press.", {});
  intact.AddLog(log, {});
  EXPECT_EQ(intact.devices().at("axis1").positions.samples(), 50);
  EXPECT_EQ(intact.next(), 55);
  EXPECT_EQ(intact.bytes(), log.size());
  EXPECT_EQ(intact.gaps(), 0);

  log[log.size() / 2] ^= 1;  // in the third stretch
  LogDigest damaged(INT64_MAX, "press.", {});
  damaged.AddLog(log, {{22, 10}});
  EXPECT_EQ(damaged.devices().at("axis1").positions.samples(), 40);
  EXPECT_EQ(damaged.next(), 55);
  EXPECT_EQ(damaged.bytes(), log.size());
  EXPECT_EQ(damaged.gaps(), 1);
  EXPECT_EQ(damaged.missing(), 10);
  EXPECT_THAT(damaged.unexplained(), IsEmpty());
  EXPECT_NE(damaged.chain(), intact.chain());
}

TEST(LogDigest, DamageWithoutAHoleIsUnexplained) {
  std::vector<std::uint8_t> log = SealedLog();
  log[log.size() / 2] ^= 1;
  LogDigest digest(INT64_MAX, "press.", {});
  digest.AddLog(log, {{11, 10}});  // a hole of an intact stretch: the database did not accept its rows
  EXPECT_THAT(digest.unexplained(), ElementsAre(22));
  EXPECT_EQ(digest.gaps(), 1);

  LogDigest before(22, "press.", {});  // the stretch was not shipped yet
  before.AddLog(log, {});
  EXPECT_THAT(before.unexplained(), IsEmpty());
  EXPECT_EQ(before.next(), 22);
}

}  // namespace
}  // namespace axlecast
