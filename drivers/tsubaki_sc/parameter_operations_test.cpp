#include <gmock/gmock.h>

#include <axlecast/command_status_t.hpp>

#include "drivers/tsubaki_sc/device_test_support.h"
#include "drivers/tsubaki_sc/register_map.h"

namespace axlecast::tsubaki_sc {
namespace {

using Reason = command_status_t;
using testing::HasSubstr;

const Change* FindChange(const Outcome& outcome, const std::string& key) {
  const auto found = std::find_if(outcome.changes.begin(), outcome.changes.end(),
                                  [&](const Change& change) { return change.key == key; });
  return found == outcome.changes.end() ? nullptr : &*found;
}
std::string After(const Outcome& outcome, const std::string& key) {
  const Change* change = FindChange(outcome, key);
  return change == nullptr ? "(none)" : change->after;
}

// ---- reading ----

TEST(ReadParameter, ShowsOneInItsUnit) {
  DeviceFixture bench;
  bench.GoOnline();
  EXPECT_EQ(bench.Do("read_parameter", {{"name", "start_time_2"}}).state, CommandState::kSucceeded);
  EXPECT_EQ(bench.Last().text, "start_time_2 3.1 s");  // register 21 holds 31
  EXPECT_EQ(After(bench.Last(), "start_time_2"), "3.1");
}

TEST(ReadParameters, ShowsAllAsFourHexDigitsARegister) {
  DeviceFixture bench;
  bench.GoOnline();
  EXPECT_EQ(bench.Do("read_parameters").state, CommandState::kSucceeded);
  std::string digits;
  for (const char* key : {"registers 0-18", "registers 19-36", "registers 37-54"}) {
    ASSERT_NE(FindChange(bench.Last(), key), nullptr) << key;
    EXPECT_LE(After(bench.Last(), key).size(), 80U) << "a change_t holds it";
    digits += After(bench.Last(), key);
  }
  ASSERT_EQ(digits.size(), 4U * 55);
  for (unsigned i = 0; i < 55; ++i) {
    EXPECT_EQ(std::stoul(digits.substr(std::size_t{4} * i, 4), nullptr, 16), bench.unit.holdings[i]) << i;
  }
}

// Guideline 7: an address that does not exist is an error, so no request may span a gap. 0 to 54 are asked for once each,
// and no more at a time than a log has: more in one request is not documented.
TEST(ReadParameters, NoRequestSpansAGap) {
  DeviceFixture bench;
  bench.GoOnline();
  bench.sent.clear();
  EXPECT_EQ(bench.Do("read_parameters").state, CommandState::kSucceeded);
  std::vector<int> asked(55, 0);
  for (const DeviceFixture::Sent& one : bench.sent) {
    if (one.request[1] != 0x03) continue;
    const unsigned first = TestUnit::Word(one.request, 2);
    const unsigned count = TestUnit::Word(one.request, 4);
    EXPECT_LE(count, 20U);
    ASSERT_LE(first + count, 55U);
    for (unsigned i = first; i < first + count; ++i) ++asked.at(i);
  }
  EXPECT_THAT(asked, testing::Each(1));
}

TEST(ReadParameters, ShowsUpToFourByName) {
  DeviceFixture bench;
  bench.GoOnline();
  const char* names = "log_interval,power_upper_a_1_50hz,excessive_shock_limit,overheat_limit";
  EXPECT_EQ(bench.Do("read_parameters", {{"names", names}}).state, CommandState::kSucceeded);
  EXPECT_EQ(After(bench.Last(), "log_interval"), "0.2");
  EXPECT_EQ(After(bench.Last(), "power_upper_a_1_50hz"), "1.0");
  EXPECT_EQ(After(bench.Last(), "excessive_shock_limit"), "0.63");
  for (const char* bad : {"", "no_such", "log_interval,,", "log_interval,log",
                          "log_interval,log_interval,log_interval,"
                          "log_interval,log_interval"}) {
    EXPECT_EQ(bench.Do("read_parameters", {{"names", bad}}).reason, Reason::REASON_BAD_ARGUMENT) << bad;
  }
}

TEST(ReadParameters, SaysWhetherAWriteTookEffect) {
  DeviceFixture bench;
  bench.GoOnline();
  const auto finding = [&](const char* after) {
    bench.Do("read_parameters", {{"after", after}});
    return After(bench.Last(), "finding");
  };
  EXPECT_EQ(finding("write_parameter name=log_interval value=0.2"), "reads_as_after");
  EXPECT_EQ(finding("write_parameter name=log_interval value=0.2 s"), "reads_as_after");
  EXPECT_EQ(finding("write_parameters log_interval=0.2 start_time_1=1.8"), "reads_as_after");
  EXPECT_EQ(finding("write_parameters log_interval=0.2 start_time_1=1.9"), "no_effect_seen");
  EXPECT_EQ(finding("clear_trip_count"), "(none)");
  EXPECT_EQ(bench.Last().reason, Reason::REASON_BAD_ARGUMENT);
}

// ---- writing ----

TEST(WriteParameter, IsReadBackAndCountsAsWear) {
  DeviceFixture bench(kLoginKeys);
  bench.GoOnline();
  EXPECT_EQ(bench.Do("write_parameter", {{"name", "power_upper_b_3_60hz"}, {"value", "125.5"}}).state,
            CommandState::kSucceeded)
      << bench.Last().text;
  EXPECT_TRUE(bench.Last().verified);
  EXPECT_EQ(bench.unit.holdings[29], 1'255);
  EXPECT_EQ(bench.output.nv_writes, 1);
  EXPECT_EQ(bench.Count({0x06, 0x00, 29, 0x04, 0xE7}), 2) << "function 06; refused, and again after the login";
  const Change* change = FindChange(bench.Last(), "power_upper_b_3_60hz");
  ASSERT_NE(change, nullptr);
  EXPECT_EQ(change->before, "3.9");
  EXPECT_EQ(change->after, "125.5");
}

TEST(WriteParameters, WritesNeighboursTogetherAndOnlyWhatDiffers) {
  DeviceFixture bench(kLoginKeys);
  bench.unit.logged_in = true;
  bench.GoOnline();
  EXPECT_EQ(bench
                .Do("write_parameters", {{"shock_time_upper_b_1", "7"},  // 10
                                         {"start_time_1", "5"},          // 8
                                         {"shock_time_upper_a_1", "6"},  // 9
                                         {"log_interval", "0.2"},        // as it is
                                         {"overheat_limit", "100"}})     // 52
                .state,
            CommandState::kSucceeded)
      << bench.Last().text;
  EXPECT_EQ(bench.unit.holdings[8], 50);
  EXPECT_EQ(bench.unit.holdings[9], 60);
  EXPECT_EQ(bench.unit.holdings[10], 70);
  EXPECT_EQ(bench.unit.holdings[52], 1'000);
  EXPECT_EQ(bench.Count({0x10}), 1);
  EXPECT_EQ(bench.Count({0x06}), 1);
  EXPECT_EQ(bench.output.nv_writes, 2);
  EXPECT_THAT(bench.Last().text, HasSubstr("4 of 5 parameters were written"));
  // Again: nothing is written.
  EXPECT_EQ(bench.Do("write_parameters", {{"start_time_1", "5"}}).state, CommandState::kSucceeded);
  EXPECT_EQ(bench.output.nv_writes, 2);
}

TEST(WriteParameters, TakesSixteen) {
  DeviceFixture bench(kLoginKeys);
  bench.unit.logged_in = true;
  bench.GoOnline();
  std::vector<std::pair<std::string, std::string>> sixteen;
  for (std::size_t i = 0; i < 16; ++i) sixteen.emplace_back(Parameters()[i].name, "0.4");
  EXPECT_EQ(bench.Do("write_parameters", sixteen).state, CommandState::kSucceeded) << bench.Last().text;
  for (unsigned i = 0; i < 16; ++i) EXPECT_EQ(bench.unit.holdings[i], 4) << i;
  EXPECT_EQ(bench.Last().changes.size(), 4U);
  sixteen.emplace_back(Parameters()[16].name, "0.5");
  EXPECT_EQ(bench.Do("write_parameters", sixteen).reason, Reason::REASON_BAD_ARGUMENT);
}

TEST(WriteParameters, AllAreCheckedBeforeAnyIsSent) {
  DeviceFixture bench(kLoginKeys);
  bench.GoOnline();
  const std::vector<std::vector<std::pair<std::string, std::string>>> kBad = {
      {{"start_time_1", "5"}, {"log_interval", "10.1"}},
      {{"start_time_1", "5"}, {"no_such", "1"}},
      {{"start_time_1", "5"}, {"start_time_1", "4"}},
      {{"start_time_1", ""}},
      {},
  };
  for (const auto& arguments : kBad) {
    EXPECT_EQ(bench.Do("write_parameters", arguments).reason, Reason::REASON_BAD_ARGUMENT);
    EXPECT_EQ(bench.Last().state, CommandState::kRejected);
  }
  EXPECT_EQ(bench.Do("write_parameter", {{"name", "log_interval"}}).reason, Reason::REASON_BAD_ARGUMENT);
  EXPECT_EQ(bench.Count({0x06}) + bench.Count({0x10}), 0);
}

TEST(WriteParameters, ALostReplyIsClearedUpByReadingNotByWritingAgain) {
  for (const bool done : {true, false}) {
    DeviceFixture bench(kLoginKeys);
    bench.unit.logged_in = true;
    bench.GoOnline();
    bench.wire = [&](const ByteList& request) {
      if (request[1] != 0x06) return bench.unit.Answer(request);
      if (done) static_cast<void>(bench.unit.Answer(request));
      return ByteList();
    };
    EXPECT_EQ(bench.Do("write_parameter", {{"name", "log_interval"}, {"value", "1"}}).state,
              done ? CommandState::kSucceeded : CommandState::kFailed);
    EXPECT_EQ(bench.Count({0x06}), 1);
    EXPECT_EQ(bench.output.nv_writes, 1) << "it may have been done";
    EXPECT_THAT(bench.Last().text, HasSubstr(done ? "read back" : "log_interval 0.2 instead of 1.0"));
  }
}

TEST(WriteParameters, ARefusalEndsIt) {
  DeviceFixture bench(kLoginKeys);
  bench.unit.logged_in = true;
  bench.GoOnline();
  bench.wire = [&](const ByteList& request) {
    return request[1] == 0x06 && request[3] == 54 ? WithCrc({1, 0x86, 0x03}) : bench.unit.Answer(request);
  };
  EXPECT_EQ(bench.Do("write_parameters", {{"log_interval", "1"}}).state, CommandState::kFailed);
  EXPECT_THAT(bench.Last().text, HasSubstr("nothing was written"));
  EXPECT_EQ(bench.output.nv_writes, 0);
  EXPECT_EQ(bench.Do("write_parameters", {{"log_interval", "1"}, {"start_time_1", "5"}}).state,
            CommandState::kFailed);
  EXPECT_EQ(bench.Last().reason, Reason::REASON_DEVICE_REFUSED);
  EXPECT_THAT(bench.Last().text, HasSubstr("log_interval 0.2 instead of 1.0"));
  EXPECT_EQ(bench.unit.holdings[8], 50) << "the one before it was written";
}

TEST(WriteParameters, IsIndeterminateWhenItCannotBeReadBack) {
  DeviceFixture bench(kLoginKeys);
  bench.unit.logged_in = true;
  bench.GoOnline();
  bool written = false;
  bench.wire = [&](const ByteList& request) {
    written = written || request[1] == 0x06;
    return written ? ByteList() : bench.unit.Answer(request);
  };
  EXPECT_EQ(bench.Do("write_parameters", {{"log_interval", "1"}}).state, CommandState::kIndeterminate);
  EXPECT_EQ(After(bench.Last(), "log_interval"), "");
}

}  // namespace
}  // namespace axlecast::tsubaki_sc
