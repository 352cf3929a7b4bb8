#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "tools/axlecast/common/subcommands.h"

namespace axlecast {
namespace {

using testing::HasSubstr;
using testing::Not;

struct Answer {
  int exit_code = -1;
  std::string out;
};

Answer CommandLine(const std::string& line) {
  CLI::App app;
  Answer answer;
  AddSsiPlanCommand(app, answer.exit_code);
  testing::internal::CaptureStdout();
  app.parse(line);
  answer.out = testing::internal::GetCapturedStdout();
  return answer;
}

// TWK SSI 11.3: 200 m: 2900 ns; 300 kHz is the maximum permitted there, a cycle of 3.3 us. 10: 15 us allow more than
// 66.7 kHz.
TEST(SsiPlan, TheDocumentsExample) {
  const Answer answer = CommandLine("ssi-plan --cable 200 --bits 25");
  EXPECT_EQ(answer.exit_code, 0);
  for (const char* text : {"2900 ns from an edge", "66667 Hz (monoflop 15 us)", "172414 Hz over SPI",
                           "300000 Hz where reading", "(chosen): right for SPI", "32 clocks for 25 bits"}) {
    EXPECT_THAT(answer.out, HasSubstr(text));
  }
  EXPECT_THAT(answer.out, Not(HasSubstr("not right")));
}

// 11.4: t_TD < t_EV < t_TD + t_T, best in the middle. SPI samples too early for that.
TEST(SsiPlan, TheDocumentsClock) {
  const Answer answer = CommandLine("ssi-plan --cable 200 --bits 25 --clock 300000 --json");
  EXPECT_EQ(answer.exit_code, 1);
  const nlohmann::json json = nlohmann::json::parse(answer.out);
  EXPECT_EQ(json["ok"], false);
  EXPECT_EQ(json["delayed_ok"], true);
  EXPECT_EQ(json["delay_ns"], 2900);
  EXPECT_EQ(json["evaluation_least_ns"], 2900);
  EXPECT_NEAR(json["evaluation_best_ns"].get<double>(), 2900 + 1666.7, 0.1);
  EXPECT_NEAR(json["evaluation_most_ns"].get<double>(), 2900 + 3333.3, 0.1);
  EXPECT_NEAR(json["highest_hz"].get<double>(), 172'413.8, 0.1);
  EXPECT_EQ(json["highest_delayed_hz"], 300'000);
  EXPECT_THAT(CommandLine("ssi-plan --cable 200 --bits 25 --clock 300000").out, HasSubstr("too fast for SPI"));
  EXPECT_THAT(CommandLine("ssi-plan --cable 200 --bits 25 --clock 400000").out,
              HasSubstr("too fast for this line"));
}

// 10: t_M = 10 us to 30 us: at least 100 kHz, and 30 us between two readings.
TEST(SsiPlan, TheDocumentsMonoflop) {
  const std::string line = "ssi-plan --cable 0 --bits 18 --monoflop-us 10 --pause-us 30";
  const Answer slow = CommandLine(line + " --clock 100000");
  EXPECT_EQ(slow.exit_code, 1);
  EXPECT_THAT(slow.out, HasSubstr("too slow: the monoflop runs down"));
  const Answer answer = CommandLine(line + " --clock 200000 --json");
  EXPECT_EQ(answer.exit_code, 0);
  const nlohmann::json json = nlohmann::json::parse(answer.out);
  EXPECT_EQ(json["lowest_hz"], 100'000);
  EXPECT_EQ(json["clocks"], 24);
  EXPECT_DOUBLE_EQ(json["reading_us"].get<double>(), 24 * 5 + 30);
}

// SAA manual 5.5 (2): 100 kHz < f < 250 kHz, Tm > 500 us.
TEST(SsiPlan, AnSaaEncoder) {
  const std::string line = "ssi-plan --cable 10 --bits 12 --min-clock 100000 --max-clock 250000 --monoflop-us 0";
  EXPECT_EQ(CommandLine(line).exit_code, 0);
  EXPECT_EQ(CommandLine(line + " --clock 100000").exit_code, 1);
  EXPECT_EQ(CommandLine(line + " --clock 249000").exit_code, 0);
  EXPECT_EQ(CommandLine(line + " --clock 250000").exit_code, 1);
}

TEST(SsiPlan, ACableThatNoClockFits) {
  const Answer answer = CommandLine("ssi-plan --cable 1000 --bits 25");
  EXPECT_EQ(answer.exit_code, 1);
  EXPECT_THAT(answer.out, HasSubstr("shorten the cable"));
  const nlohmann::json json = nlohmann::json::parse(CommandLine("ssi-plan --cable 1000 --bits 25 --json").out);
  EXPECT_TRUE(json["clock_hz"].is_null());
  EXPECT_TRUE(json["reading_us"].is_null());
}

TEST(SsiPlan, WrongUsage) {
  for (const char* line : {"ssi-plan", "ssi-plan --cable 10", "ssi-plan --cable -1 --bits 12",
                           "ssi-plan --cable 10 --bits 0", "ssi-plan --cable 10 --bits 12 --clock 0"}) {
    CLI::App app;
    int exit_code = 0;
    AddSsiPlanCommand(app, exit_code);
    EXPECT_THROW(app.parse(line), CLI::ParseError) << line;
  }
}

}  // namespace

}  // namespace axlecast
