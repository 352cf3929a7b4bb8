#include "drivers/cia406/simulator.h"

#include <gmock/gmock.h>

#include <map>

#include "core/device/operation.h"
#include "tests/support/golden_file.h"

namespace axlecast::cia406 {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// A simulated node, which is tested with bytes as the standard prints them.
class Cia406NodeTest : public testing::Test {
 protected:
  Cia406NodeTest() { Run(100 * kMillisecond); }

  void Run(MonoNs time) {
    const MonoNs end = now_ + time;
    while (node_.NextDue() <= end) {
      now_ = std::max(now_, node_.NextDue());
      node_.OnDue(
          now_, [this](const CanFrame& frame) { sent_.push_back(Text("%03X ", frame.id) + HexText(frame.data)); });
    }
    now_ = end;
  }
  // Returns what the node sends within 10 ms of a frame.
  std::vector<std::string> Send(std::uint32_t id, const std::string& bytes) {
    sent_.clear();
    CanFrame frame{.id = id, .data = {}};
    frame.data.Append(Bytes(GoldenBytes(bytes)));
    node_.OnFrame(frame, now_);
    Run(10 * kMillisecond);
    return sent_;
  }
  std::vector<std::string> Ask(const std::string& bytes) { return Send(0x605, bytes); }
  std::string Shown(const std::string& name) {
    const auto state = node_.State(now_);
    return std::map<std::string, std::string>(state.begin(), state.end())[name];
  }
  std::string Set(std::string_view name, std::string_view value) {
    node_.Advance(now_);
    const Result<> done = node_.Set(name, value);
    return done ? "" : done.error().text;
  }

  Cia406Node node_{{.node = 5,
                    .bits = 13,
                    .turn_bits = 12,
                    .cob_id = 0x185,
                    .identity = {0x2DC, 0x58, 0x00010002, 4711},
                    .angle = -AngleFromDegrees(90)}};
  MonoNs now_ = kSecond;
  std::vector<std::string> sent_;
};

// CiA 301 7.2.8.3.3, 7.3.2.2.1.
TEST_F(Cia406NodeTest, BootsUpIntoPreOperational) {
  EXPECT_THAT(sent_, ElementsAre("705 00"));
  EXPECT_EQ(Shown("nmt"), "pre_operational");
}

// 7.3.2: what each NMT command does, to its node or to all.
TEST_F(Cia406NodeTest, NmtCommands) {
  const auto after = [&](const std::string& command) {
    Send(0x000, command);
    return Shown("nmt");
  };
  EXPECT_EQ(after("01 05"), "operational");
  EXPECT_EQ(after("02 05"), "stopped");
  EXPECT_EQ(after("80 05"), "pre_operational");
  EXPECT_EQ(after("01 00"), "operational") << "all nodes";
  EXPECT_EQ(after("02 06"), "operational") << "another node";
  EXPECT_EQ(after("55 05"), "operational") << "no command";
  EXPECT_EQ(after("02"), "operational") << "too short";
  EXPECT_EQ(after("81 05"), "booting");
  Run(100 * kMillisecond);
  EXPECT_THAT(sent_, ElementsAre("705 00"));
  EXPECT_EQ(after("82 05"), "booting");
  EXPECT_EQ(Shown("resets"), "2");
  EXPECT_EQ(Shown("ignored"), "2");
}

// 7.2.4.3.6: 43, 4B, 4F by the object's size.
TEST_F(Cia406NodeTest, UploadsAreExpeditedBySize) {
  EXPECT_THAT(Ask("40 00 10 00 00 00 00 00"), ElementsAre("585 43 00 10 00 96 01 02 00"));
  EXPECT_THAT(Ask("40 18 10 01 00 00 00 00"), ElementsAre("585 43 18 10 01 DC 02 00 00"));
  EXPECT_THAT(Ask("40 18 10 00 00 00 00 00"), ElementsAre("585 4F 18 10 00 04 00 00 00"));
  EXPECT_THAT(Ask("40 00 65 00 00 00 00 00"), ElementsAre("585 4B 00 65 00 04 00 00 00"));
  EXPECT_THAT(Ask("40 01 60 00 00 00 00 00"), ElementsAre("585 43 01 60 00 00 20 00 00"));
  EXPECT_THAT(Ask("40 02 60 00 00 00 00 00"), ElementsAre("585 43 02 60 00 00 00 00 02"));
  EXPECT_THAT(Ask("40 04 60 00 00 00 00 00"), ElementsAre("585 43 04 60 00 00 08 00 00")) << "a quarter turn";
  EXPECT_THAT(Ask("40 08 10 00 00 00 00 00"), ElementsAre("585 41 08 10 00 11 00 00 00")) << "segmented, 17 bytes";
}

// Table 22.
TEST_F(Cia406NodeTest, AbortCodes) {
  EXPECT_THAT(Ask("40 FF 1F 00 00 00 00 00"), ElementsAre("585 80 FF 1F 00 00 00 02 06")) << "no such object";
  EXPECT_THAT(Ask("40 18 10 09 00 00 00 00"), ElementsAre("585 80 18 10 09 11 00 09 06")) << "no such sub-index";
  EXPECT_THAT(Ask("23 04 60 00 01 00 00 00"), ElementsAre("585 80 04 60 00 02 00 01 06")) << "read-only";
  EXPECT_THAT(Ask("2F 17 10 00 01 00 00 00"), ElementsAre("585 80 17 10 00 13 00 07 06")) << "too short";
  EXPECT_THAT(Ask("23 17 10 00 01 00 00 00"), ElementsAre("585 80 17 10 00 12 00 07 06")) << "too long";
  EXPECT_THAT(Ask("21 17 10 00 08 00 00 00"), ElementsAre("585 80 17 10 00 01 00 04 05")) << "segmented download";
  EXPECT_THAT(Ask("23 03 60 00 00 00 00 02"), ElementsAre("585 80 03 60 00 30 00 09 06")) << "2^25 is out of range";
  EXPECT_THAT(Ask("23 10 10 01 00 00 00 00"), ElementsAre("585 80 10 10 01 20 00 00 08")) << "no signature";
}

TEST_F(Cia406NodeTest, OneTransferAtATime) {
  CanFrame frame{.id = 0x605, .data = {0x40, 0x00, 0x10, 0, 0, 0, 0, 0}};
  node_.OnFrame(frame, now_);
  EXPECT_THAT(Ask("40 18 10 01 00 00 00 00"), ElementsAre("585 43 00 10 00 96 01 02 00")) << "the first one's";
  EXPECT_EQ(Shown("overlapping"), "1");
  node_.OnFrame(frame, now_);
  EXPECT_THAT(Ask("80 00 10 00 00 00 04 05"), IsEmpty()) << "an abort ends it without an answer";
  EXPECT_EQ(Shown("aborted"), "1");
}

TEST_F(Cia406NodeTest, AStoppedNodeAnswersNoSdo) {
  Send(0x000, "02 05");
  EXPECT_THAT(Ask("40 00 10 00 00 00 00 00"), IsEmpty());
  EXPECT_THAT(Send(0x605, "40 00 10 00"), IsEmpty()) << "and none of 4 bytes";
}

TEST_F(Cia406NodeTest, PositionsComeWhileOperationalByItsEventTimer) {
  Run(kSecond);
  EXPECT_EQ(Shown("positions"), "0");
  Send(0x000, "01 05");
  sent_.clear();
  Run(250 * kMillisecond);
  EXPECT_THAT(sent_, ElementsAre("185 00 08 00 00", "185 00 08 00 00"));
  EXPECT_THAT(Ask("2B 00 18 05 05 00 00 00"), testing::Contains("585 60 00 18 05 00 00 00 00"));
  sent_.clear();
  Run(100 * kMillisecond);
  EXPECT_EQ(sent_.size(), 20U) << "every 5 ms";
}

TEST_F(Cia406NodeTest, SynchronousPositionsComeAtEachNthSync) {
  Ask("2F 00 18 02 02 00 00 00");
  EXPECT_THAT(Send(0x080, ""), IsEmpty()) << "not operational";
  Send(0x000, "01 05");
  EXPECT_THAT(Send(0x080, ""), IsEmpty());
  EXPECT_THAT(Send(0x080, ""), ElementsAre("185 00 08 00 00"));
  EXPECT_THAT(Send(0x080, "01"), IsEmpty()) << "with a counter too";
}

TEST_F(Cia406NodeTest, APdoThatIsOffIsNotSent) {
  Ask("23 00 18 01 85 01 00 80");
  Send(0x000, "01 05");
  sent_.clear();
  Run(kSecond);
  EXPECT_THAT(sent_, IsEmpty());
}

TEST_F(Cia406NodeTest, TheHeartbeatTellsItsState) {
  Ask("2B 17 10 00 64 00 00 00");
  sent_.clear();
  Run(95 * kMillisecond);
  EXPECT_THAT(sent_, ElementsAre("705 7F"));
  Send(0x000, "02 05");
  sent_.clear();
  Run(100 * kMillisecond);
  EXPECT_THAT(sent_, ElementsAre("705 04"));
}

// CiA 406, 6003h: what is written is the position from then on; 6509h is the offset; without a save a reset forgets
// it.
TEST_F(Cia406NodeTest, PresetOffsetAndSave) {
  EXPECT_THAT(Ask("23 03 60 00 E8 03 00 00"), ElementsAre("585 60 03 60 00 00 00 00 00"));
  EXPECT_THAT(Ask("40 04 60 00 00 00 00 00"), ElementsAre("585 43 04 60 00 E8 03 00 00"));
  EXPECT_THAT(Ask("40 09 65 00 00 00 00 00"), ElementsAre("585 43 09 65 00 E8 FB FF 01"));
  Send(0x000, "81 05");
  Run(100 * kMillisecond);
  EXPECT_EQ(Shown("position"), "2048");
  Ask("23 03 60 00 E8 03 00 00");
  Ask("23 10 10 01 73 61 76 65");
  Run(kSecond);
  EXPECT_EQ(sent_.back(), "585 60 10 10 01 00 00 00 00") << "when it has stored";
  Send(0x000, "81 05");
  Run(100 * kMillisecond);
  EXPECT_EQ(Shown("position"), "1000");
  EXPECT_EQ(Shown("saves"), "1");
}

// 7.2.7: code low byte first, error register; 0000 when it is over.
TEST_F(Cia406NodeTest, Emergencies) {
  sent_.clear();
  EXPECT_EQ(Set("emergency", "0x3110"), "");
  Run(kMillisecond);
  EXPECT_EQ(Set("emergency", "0"), "");
  Run(kMillisecond);
  EXPECT_THAT(sent_, ElementsAre("085 10 31 05 00 00 00 00 00", "085 00 00 00 00 00 00 00 00"));
}

TEST_F(Cia406NodeTest, CountsClockwiseUnlessCounterClockwise) {
  EXPECT_EQ(Shown("position"), "2048") << "a quarter turn clockwise";
  Cia406Node other({.node = 5, .ccw = true, .angle = AngleFromDegrees(90)});
  other.OnDue(now_, [](const CanFrame&) {});
  const auto state = other.State(now_);
  EXPECT_EQ((std::map<std::string, std::string>(state.begin(), state.end())["position"]), "2048");
}

TEST_F(Cia406NodeTest, NamesWhatItCannotSet) {
  EXPECT_THAT(Set("fault", "bit_flip"), HasSubstr("drop damaged frames"));
  EXPECT_THAT(Set("object", "6004"), HasSubstr("INDEX:SUB=VALUE"));
  EXPECT_THAT(Set("object", "7777:00=1"), HasSubstr("there is no object 7777:00"));
  EXPECT_THAT(Set("power", "perhaps"), HasSubstr("not one of on, off, cycle"));
  EXPECT_THAT(Set("nmt", "asleep"), HasSubstr("not one of"));
  EXPECT_THAT(Set("colour", "red"), HasSubstr("one of bitrate"));
  for (const char* fault :
       {"none", "off", "stuck", "garbage", "short", "slow:100", "delayed:5", "intermittent:0.5"}) {
    EXPECT_EQ(Set("fault", fault), "") << fault;
  }
}

TEST_F(Cia406NodeTest, WithoutPowerItIsNotThere) {
  EXPECT_TRUE(node_.present());
  EXPECT_EQ(Set("power", "off"), "");
  EXPECT_FALSE(node_.present());
  EXPECT_THAT(Ask("40 00 10 00 00 00 00 00"), IsEmpty());
}

}  // namespace
}  // namespace axlecast::cia406
