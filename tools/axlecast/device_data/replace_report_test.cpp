#include "tools/axlecast/device_data/replace_report.h"

#include <gmock/gmock.h>
#include <axlecast/device_info_t.hpp>

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

CommandResult Ended(const char* operation, std::int8_t state) {
  CommandResult result;
  result.answered = true;
  result.status.device = "axis1";
  result.status.operation = operation;
  result.status.state = state;
  result.status.verified = 1;
  result.status.is_final = 1;
  return result;
}

ReplaceReport Whole() {
  ReplaceReport report;
  report.device = "axis1";
  report.backup = "axis1.txt";
  report.encoder = "identity 17";
  report.accepted = Ended("accept_exchange", command_status_t::STATE_SUCCEEDED);
  report.written = {Ended("eeprom_write", command_status_t::STATE_SUCCEEDED)};
  report.datum = Ended("set_datum", command_status_t::STATE_SUCCEEDED);
  return report;
}

TEST(ReplaceReport, OfAWholeExchange) {
  const ReplaceReport report = Whole();
  EXPECT_EQ(ToText(report),
            "axis1\n"
            "  backup     axis1.txt\n"
            "  answers    identity 17\n"
            "  accepted   axis1 accept_exchange: SUCCEEDED, verified\n"
            "  written    axis1 eeprom_write: SUCCEEDED, verified\n"
            "  datum      axis1 set_datum: SUCCEEDED, verified\n");
  const auto json = ToJson(report);
  EXPECT_EQ(json["written"][0]["outcome"], "succeeded");
  EXPECT_EQ(json["accepted"]["operation"], "accept_exchange");
  EXPECT_TRUE(json["stopped_at"].is_null());
  EXPECT_TRUE(json["next"].is_null());
  EXPECT_TRUE(json["backup_problem"].is_null());
}

TEST(ReplaceReport, WithoutADatumSaysHowToSetIt) {
  ReplaceReport report = Whole();
  report.datum.reset();
  EXPECT_THAT(ToText(report), HasSubstr("not REFERENCED until\n  axlecast home axis1 --value V\n"));
  EXPECT_EQ(ToJson(report)["next"], "axlecast home axis1 --value V");
  report.has_position = false;
  EXPECT_EQ(NextCommand(report), "");
}

TEST(ReplaceReport, AStopSaysWhatHoldsAndHowToGoOn) {
  ReplaceReport report;
  report.device = "axis1";
  report.stopped = ReplaceStep::kExchange;
  EXPECT_THAT(ToText(report), HasSubstr("stopped at exchange: nothing was changed"));
  EXPECT_EQ(NextCommand(report), "axlecast replace axis1 --from exchange");
  report.backup = "b.txt";
  report.stopped = ReplaceStep::kAccept;
  EXPECT_EQ(NextCommand(report), "axlecast replace axis1 --from accept --backup b.txt");
  EXPECT_THAT(ToText(report), HasSubstr("still counts the wear of the old one"));
  EXPECT_EQ(ToJson(report)["stopped_at"], "accept");
}

TEST(ReplaceReport, ACommandInDoubtIsNotCalledUndone) {
  ReplaceReport report = Whole();
  report.datum.reset();
  report.accepted = Ended("accept_exchange", command_status_t::STATE_INDETERMINATE);
  report.stopped = ReplaceStep::kAccept;
  EXPECT_THAT(ToText(report), HasSubstr("stopped at accept: the last command may have been done"));
}

TEST(ReplaceReport, NamesWhatStaysDifferent) {
  ReplaceReport report = Whole();
  EXPECT_THAT(ToText(report), Not(HasSubstr("differs")));
  report.not_permitted = {4, 72};
  EXPECT_THAT(ToText(report), HasSubstr("differs    addresses 4 72: not written"));
  EXPECT_EQ(ToJson(report)["not_permitted"], (std::vector<std::size_t>{4, 72}));
}

using Stage = ExchangeWatch::Stage;

constexpr std::int8_t kOnline = device_info_t::STATE_ONLINE;
constexpr std::int8_t kDegraded = device_info_t::STATE_DEGRADED;
constexpr std::int8_t kOffline = device_info_t::STATE_OFFLINE;
constexpr std::int8_t kStarting = device_info_t::STATE_STARTING;

TEST(ExchangeWatch, AwayAndSteadilyBack) {
  ExchangeWatch watch;
  watch.On(kOnline, 7, 0);
  watch.On(kOnline, 7, 100 * kSecond);
  EXPECT_EQ(watch.stage(), Stage::kThere);
  watch.On(kOffline, 7, 101 * kSecond);
  EXPECT_EQ(watch.stage(), Stage::kAway);
  watch.On(kOnline, 7, 200 * kSecond);
  EXPECT_EQ(watch.stage(), Stage::kAway);
  watch.On(kDegraded, 7, 201 * kSecond);
  EXPECT_EQ(watch.stage(), Stage::kBack) << "a new one may have alarms";
}

TEST(ExchangeWatch, ABreakBeginsTheSecondAnew) {
  ExchangeWatch watch;
  watch.On(kOffline, 7, 0);
  watch.On(kOnline, 7, 10 * kSecond);
  watch.On(kStarting, 7, 10 * kSecond + kSecond / 2);
  watch.On(kOnline, 7, 11 * kSecond);
  watch.On(kOnline, 7, 12 * kSecond - 1);
  EXPECT_EQ(watch.stage(), Stage::kAway);
  watch.On(kOnline, 7, 12 * kSecond);
  EXPECT_EQ(watch.stage(), Stage::kBack);
}

TEST(ExchangeWatch, ASilentOrRestartedDriverWasAway) {
  ExchangeWatch silent;
  silent.On(kOnline, 7, 0);
  silent.On(std::nullopt, 0, kSecond);
  EXPECT_EQ(silent.stage(), Stage::kAway);
  ExchangeWatch restarted;
  restarted.On(kOnline, 7, 0);
  restarted.On(kOnline, 8, kSecond);
  EXPECT_EQ(restarted.stage(), Stage::kAway);
  restarted.On(kOnline, 8, 2 * kSecond);
  EXPECT_EQ(restarted.stage(), Stage::kBack);
}

}  // namespace
}  // namespace axlecast
