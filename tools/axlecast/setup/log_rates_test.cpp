#include "tools/axlecast/setup/log_rates.h"

#include <gtest/gtest.h>

#include <axlecast/position_block_t.hpp>
#include <axlecast/position_t.hpp>
#include <string>
#include <vector>

#include "core/config/load.h"
#include "core/messages/message.h"
#include "tools/axlecast/setup/config_report.h"
#include "tools/log/log_event.h"

namespace axlecast {
namespace {

// An axis `a` that is read 500 times a second and published 250 times, and the logs of a recorder.
MachineConfig Machine(const std::string& logs, const std::string& bus = "", const std::string& device = "") {
  ConfigErrors errors("m.yaml");
  const auto machine = ParseConfig("machine: press3\nrecorder: {logs: {" + logs +
                                       "}}\nbuses:\n  b0: {family: tformat, simulate: true, poll_hz: 500" + bus +
                                       ", devices: {a: {model: ts5669n127, publish_hz: 250" + device + "}}}\n",
                                   errors);
  EXPECT_EQ(errors.Text(), "");
  return machine.value_or(MachineConfig{});
}

double RateOf(const MachineConfig& machine) { return LogBytesPerSecond(machine, machine.recorder.logs.at(0)); }

// The size of a record as a log has it.
double PositionRecord(const std::string& channel) {
  const std::vector<std::uint8_t> data = Encoded(position_t{});
  return static_cast<double>(EventSize({.number = 0, .utime = 0, .channel = channel, .data = data}));
}

constexpr double kSeal = 28 + 13 + 20;  // bytes, once a second: tools/log/log_event.h

TEST(LogBytesPerSecond, IsThatOfTheRecordsOfEachPublishedPosition) {
  EXPECT_NEAR(RateOf(Machine("p: {channels: '^POSITION/'}")), 250 * PositionRecord("POSITION/a") + kSeal, 1);
}

TEST(LogBytesPerSecond, ABlockHasEveryReading) {
  const double blocks = RateOf(Machine("p: {channels: '^POSITION_BLOCK/'}", "", ", block: true"));
  EXPECT_GT(blocks, 500 * 20);
  EXPECT_LT(blocks, 500 * 25) << "20 bytes a sample, and an envelope for 40 samples";
  EXPECT_NEAR(RateOf(Machine("p: {channels: '^POSITION_BLOCK/'}")), kSeal, 1) << "without block";
}

TEST(LogBytesPerSecond, ABlockOfASlowAxisIsSentAfter100Milliseconds) {
  MachineConfig machine = Machine("p: {channels: '^POSITION_BLOCK/'}", "", ", block: true");
  machine.buses[0].poll_hz = 50;
  const auto envelope =
      static_cast<double>(kEventHeader + sizeof "POSITION_BLOCK/a" - 1) + position_block_t().getEncodedSize();
  EXPECT_NEAR(RateOf(machine), 50 * 20 + 10 * envelope + kSeal, 1) << "ten blocks of five samples";
}

TEST(LogBytesPerSecond, WireCountsWhatIsCapturedOnly) {
  EXPECT_NEAR(RateOf(Machine("w: {channels: '^WIRE/'}")), kSeal, 1);
  const double wire = RateOf(Machine("w: {channels: '^WIRE/'}", ", capture: true"));
  EXPECT_GT(wire, 500 * (12 + 32)) << "a request of one byte and a reply of eleven, with 16 bytes more each";
  EXPECT_LT(wire, 500 * 80);
}

TEST(LogBytesPerSecond, ChannelsThatAreLeftOutDoNotCount) {
  const double all = RateOf(Machine("l: {keep: 14d}"));
  const double positions = RateOf(Machine("l: {channels: '^POSITION/'}"));
  const double others = RateOf(Machine("l: {channels: '^POSITION/', invert: true}"));
  EXPECT_NEAR(all + kSeal, positions + others, 1);
  EXPECT_LT(others, 0.1 * positions);
}

TEST(LogBytesPerSecond, APrefixIsPartOfTheName) {
  MachineConfig machine = Machine("p: {channels: '^POSITION/'}");
  machine.lcm.prefix = "press3/";
  EXPECT_NEAR(RateOf(machine), kSeal, 1) << "the expression does not fit the name any more";
}

TEST(QuotaLasts, IsTheQuotaDividedByTheRate) {
  const MachineConfig machine = Machine("p: {channels: '^POSITION/', quota: 1GB}");
  const auto lasts = QuotaLasts(machine, machine.recorder.logs.at(0));
  ASSERT_TRUE(lasts);
  const double seconds = static_cast<double>(*lasts) * 1e-9;
  EXPECT_NEAR(seconds, 1'073'741'824 / (250 * PositionRecord("POSITION/a") + kSeal), 1);
}

TEST(QuotaLasts, IsLongerIfClosedLogsAreCompressed) {
  const MachineConfig plain = Machine("p: {channels: '^POSITION/', quota: 1GB}");
  const MachineConfig compressed = Machine("p: {channels: '^POSITION/', quota: 1GB, compress: true}");
  const auto factor = static_cast<double>(*QuotaLasts(compressed, compressed.recorder.logs.at(0))) /
                      static_cast<double>(*QuotaLasts(plain, plain.recorder.logs.at(0)));
  EXPECT_NEAR(factor, 1.0 / 8 + 3.7 * 7 / 8, 0.001) << "the log that is written is an eighth, and not compressed";
}

TEST(QuotaLasts, IsUnknownWithoutAQuotaAndAroundATrigger) {
  const MachineConfig unlimited = Machine("p: {channels: '^POSITION/'}");
  EXPECT_FALSE(QuotaLasts(unlimited, unlimited.recorder.logs.at(0)));
  const MachineConfig around = Machine("p: {trigger: '^ALARM/', pre_trigger: 10s, quota: 1GB}");
  EXPECT_FALSE(QuotaLasts(around, around.recorder.logs.at(0)));
}

// The warnings about the logs.
std::vector<std::string> LogWarnings(const MachineConfig& machine) {
  std::vector<std::string> warnings = ConfigWarnings(machine);
  std::erase_if(warnings, [](const std::string& text) { return !text.starts_with("recorder log "); });
  return warnings;
}

TEST(ConfigWarnings, AQuotaThatLastsLessThanTheTimeForWhichALogIsKept) {
  EXPECT_EQ(LogWarnings(Machine("p: {keep: 14d, quota: 20GB}")),
            std::vector<std::string>{
                "recorder log p: its quota of 20GB lasts 5 days at the rates of this file, less than keep: 2w; "
                "that needs about 57 GB, or a lower publish_hz"});
  EXPECT_TRUE(LogWarnings(Machine("p: {keep: 1d, quota: 20GB}")).empty());
  EXPECT_TRUE(LogWarnings(Machine("p: {keep: 14d, quota: 20GB, compress: true}")).empty());
  EXPECT_EQ(LogWarnings(Machine("p: {keep: 14d, quota: 10GB, compress: true}")).size(), 1U);
  EXPECT_TRUE(LogWarnings(Machine("p: {keep: 14d}")).empty());
}

TEST(ConfigText, StatesForHowLongAQuotaLasts) {
  const std::string text = ConfigText(Machine("p: {channels: '^POSITION/', quota: 20GB}"));
  EXPECT_NE(text.find("about 47.8 kB/s: the quota lasts 5 days\n"), std::string::npos) << text;
  const std::string compressed = ConfigText(Machine("p: {channels: '^POSITION/', quota: 20GB, compress: true}"));
  EXPECT_NE(compressed.find(", compressed to about 1/3.7, about 47.8 kB/s: the quota lasts 17 days\n"),
            std::string::npos)
      << compressed;
}

}  // namespace
}  // namespace axlecast
