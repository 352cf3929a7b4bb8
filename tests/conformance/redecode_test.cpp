#include <gtest/gtest.h>

#include <axlecast/position_t.hpp>
#include <axlecast/wire_t.hpp>
#include <limits>
#include <map>

#include "tests/conformance/example_buses.h"
#include "tests/conformance/example_link.h"
#include "tests/support/counting_family.h"
#include "tests/support/memory_sink.h"
#include "tests/support/thorough.h"
#include "tools/redecode/log_redecoder.h"

namespace axlecast {
namespace {

// A whole driver that records its wire, in virtual time.
class RedecodeConformance : public ExampleTest {
 protected:
  void SetUp() override {
    ASSERT_TRUE(simulator_);
    captured_ = *bus_;
    captured_.capture = true;
    link_ = std::make_unique<ExampleLink>(captured_, clock_, *simulator_);
  }
  // Runs a driver from its start to its end; its messages go to live_.
  void Record(std::int64_t boot_id, MonoNs time) {
    DriverPorts ports{.secrets = &secrets_,
                      .clock = &clock_,
                      .data = &live_,
                      .commands = &commands_,
                      .log = [](LogLevel, std::string_view) {},
                      .link_warnings = {}};
    link_->PlugInto(ports);
    Driver driver(captured_, UnsignedBridge(), Origin{.boot_id = boot_id}, std::move(ports));
    for (const MonoNs end = clock_.Now() + time; clock_.Now() < end;) driver.RunOnce();
    driver.Stop();
  }
  [[nodiscard]] std::vector<wire_t> Wire() const { return live_.All<wire_t>("WIRE/" + captured_.name); }
  [[nodiscard]] std::vector<std::string> Channels() const {
    std::vector<std::string> channels;
    for (const DeviceConfig& device : captured_.devices) {
      channels.push_back((captured_.family->has_position ? "POSITION/" : "MOTOR/") + device.name);
    }
    return channels;
  }
  // What was recorded against what `again` holds.
  [[nodiscard]] RecordingDiff Against(const MemorySink& again) const {
    RecordingDiff diff;
    for (const std::string& channel : Channels()) {
      for (const auto& message : live_.Messages(channel)) diff.OnRecorded(channel, message);
      for (const auto& message : again.Messages(channel)) diff.OnRedecoded(channel, message);
    }
    diff.Finish();
    return diff;
  }

  BusConfig captured_;
  FakeClock clock_;
  MemorySink live_;
  MemorySink commands_;
  std::unique_ptr<ExampleLink> link_;
};

TEST_P(RedecodeConformance, AWholeRecordingGivesTheSameReadings) {
  Record(42, Times(30, 3) * kSecond);
  Record(43, Times(20, 4) * kSecond);
  MemorySink again;
  BusRedecoder redecoder(captured_, false, again);
  for (const wire_t& message : Wire()) redecoder.On(message);
  redecoder.Finish();
  EXPECT_TRUE(redecoder.gaps().empty());
  EXPECT_EQ(redecoder.unreadable(), 0);
  const RecordingDiff diff = Against(again);
  std::int64_t equal = 0;
  for (const auto& [channel, tally] : diff.tallies()) {
    equal += tally.equal;
    EXPECT_TRUE(tally.same()) << channel << ": " << tally.differing << " differ, " << tally.only_recorded
                              << " only recorded, " << tally.only_redecoded << " only decoded again";
    for (const auto& difference : tally.first) {
      for (const auto& field : difference.fields) {
        ADD_FAILURE() << channel << ' ' << difference.mono_ns << ' ' << field.name << ": " << field.recorded << ", "
                      << field.redecoded;
      }
    }
  }
  EXPECT_GT(equal, 1);
}

TEST_P(RedecodeConformance, WhatNoDriverCanHaveSentIsUnreadable) {
  Record(42, kSecond);
  constexpr std::int64_t kMax = std::numeric_limits<std::int64_t>::max();
  MemorySink again;
  BusRedecoder redecoder(captured_, false, again);
  std::int64_t sent = 0;
  for (const std::int64_t number : {kMax, -kMax, std::int64_t{-1}}) {
    for (std::int64_t wire_t::*field : {&wire_t::seq, &wire_t::dropped, &wire_t::mono_ns, &wire_t::utime}) {
      wire_t message = Wire().at(0);
      message.*field = number;
      redecoder.On(message);
      EXPECT_EQ(redecoder.unreadable(), ++sent);
    }
  }
  EXPECT_EQ(redecoder.events(), 0);
}

TEST_P(RedecodeConformance, AGapIsNotedAndNothingWrongIsMadeOfIt) {
  Record(42, Times(30, 2) * kSecond);
  const std::vector<wire_t> wire = Wire();
  ASSERT_GT(wire.size(), 20U);
  const std::size_t from = wire.size() / 2;
  MemorySink again;
  BusRedecoder redecoder(captured_, false, again);
  for (std::size_t i = 0; i < wire.size(); ++i) {
    if (i < from || i >= from + 5) redecoder.On(wire[i]);
  }
  redecoder.Finish();
  ASSERT_EQ(redecoder.gaps().size(), 1U);
  EXPECT_EQ(redecoder.gaps()[0].messages, 5);
  EXPECT_EQ(redecoder.gaps()[0].utime, wire[from + 5].utime);
  // Everything that is decoded was sent by the device; counted turns start again.
  std::int64_t common = 0;
  for (const DeviceConfig& device : captured_.devices) {
    std::map<MonoNs, position_t> recorded;
    for (const auto& position : live_.All<position_t>("POSITION/" + device.name))
      recorded[position.mono_ns] = position;
    for (const auto& position : again.All<position_t>("POSITION/" + device.name)) {
      const auto found = recorded.find(position.mono_ns);
      if (found == recorded.end()) continue;
      ++common;
      EXPECT_EQ(position.raw_counts, found->second.raw_counts);
      EXPECT_EQ(position.raw_turns, found->second.raw_turns);
    }
  }
  EXPECT_TRUE(common > 1 || !captured_.family->has_position);
}

INSTANTIATE_TEST_SUITE_P(, RedecodeConformance, testing::ValuesIn(ExampleBuses()), NameOf);

}  // namespace
}  // namespace axlecast
