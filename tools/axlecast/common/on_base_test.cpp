#include "tools/axlecast/common/on_base.h"

#include <gtest/gtest.h>
#include <axlecast/position_t.hpp>
#include <axlecast/time_quality_t.hpp>

#include "core/messages/json/message_json.h"
#include "core/messages/message.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

constexpr MonoNs kNow = 1'000 * kSecond;
constexpr std::int64_t kMachine = 7;
constexpr std::int64_t kClock = 0x1234;

// A host whose CLOCK_MONOTONIC is 5 s behind the base, known to 2 us.
time_quality_t Claim(std::int64_t machine) {
  time_quality_t time{};
  time.machine_id = machine;
  time.clock_id = kClock;
  time.boot_id = 1;
  time.grade = time_quality_t::GRADE_PROVEN;
  time.mono_ns = kNow;
  time.base_id = 0xABC;
  time.base_ns = kNow + 5 * kSecond;
  time.half_width_ns = 2'000;
  time.growth_ppb = 0;
  time.valid_ms = 2'000;
  return time;
}

Json Position(std::int64_t machine, std::int64_t clock) {
  position_t position{};
  position.machine_id = machine;
  position.clock_id = clock;
  position.mono_ns = kNow + kMillisecond;
  return ToJson(position);
}

TEST(OnBase, AddsTheInstantAsAnInterval) {
  OnBase base;
  base.Take(Encoded(Claim(kMachine)), kNow);
  Json line = Position(kMachine, kClock);
  base.Add(line, kNow);
  EXPECT_EQ(line["on_base"]["base_id"], "0000000000000abc");
  EXPECT_EQ(line["on_base"]["ns"], kNow + 5 * kSecond + kMillisecond);
  EXPECT_GE(line["on_base"]["half_width_ns"], 2'000);
}

TEST(OnBase, AddsNullWhereTheInstantIsNotKnown) {
  OnBase base;
  base.Take(Encoded(Claim(kMachine)), kNow);
  Json of_other_clock = Position(kMachine, kClock + 1);
  base.Add(of_other_clock, kNow);
  EXPECT_TRUE(of_other_clock.at("on_base").is_null());
  Json late = Position(kMachine, kClock);
  base.Add(late, kNow + 10 * kSecond);
  EXPECT_TRUE(late.at("on_base").is_null()) << "the host sends no claim any more";
}

TEST(OnBase, AddsNothingWithoutATimeBase) {
  OnBase base;
  Json line = Position(kMachine, kClock);
  base.Add(line, kNow);
  EXPECT_FALSE(line.contains("on_base"));
  base.Take(Encoded(Claim(kMachine + 1)), kNow);
  base.Take(Encoded(position_t{}), kNow);
  base.Take({}, kNow);
  base.Add(line, kNow);
  EXPECT_FALSE(line.contains("on_base")) << "the base of another machine";
  Json header = {{"text", "x"}};
  base.Add(header, kNow);
  EXPECT_EQ(header.size(), 1U);
}

TEST(OnBase, MachinesThatAreInventedTakeABoundedPlace) {
  OnBase base;
  base.Take(Encoded(Claim(kMachine)), kNow);
  for (int i = 0; i < 100; ++i) base.Take(Encoded(Claim(1'000 + i)), kNow);
  Json line = Position(kMachine, kClock);
  base.Add(line, kNow);
  EXPECT_TRUE(line["on_base"].is_object());
}

}  // namespace
}  // namespace axlecast
