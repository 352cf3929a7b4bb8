#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "bridge/store/store_fixture.h"
#include "tools/axlecast/common/subcommands.h"
#include "tools/axlecast/common/terminal.h"

namespace axlecast {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;
using S = command_status_t;

constexpr const char* kMachine = R"(machine: press3
buses:
  rs485-0:
    family: tformat
    link: {port: /dev/null, baud: 2500000}
    devices:
      axis1: {model: ts5669n127}
  rs485-1:
    family: tformat
    link: {port: /dev/zero, baud: 2500000}
    devices:
      axis2: {model: ts5669n127}
)";

// A journal with three commands, two datums and an event.
class JournalCommands : public StoreTest {
 protected:
  struct Result {
    int exit_code = -1;
    std::string out;
    std::string err;
    [[nodiscard]] std::vector<nlohmann::json> Objects() const {
      std::vector<nlohmann::json> objects;
      std::istringstream lines(out);
      for (std::string line; std::getline(lines, line);) objects.push_back(nlohmann::json::parse(line));
      return objects;
    }
  };

  JournalCommands() : store_(OpenStore()) {
    S status = Command(0xa1).status;
    EXPECT_TRUE(store_->Accepted(Command(0xa1), At(0)));
    status = Moved(status, S::STATE_ROUTED);
    EXPECT_TRUE(store_->Routed(status, 1, At(0.001)));
    status = Moved(status, S::STATE_RUNNING, "waits for standstill");
    store_->Step(status, At(0.002));
    status = WithChange(Moved(status, S::STATE_SUCCEEDED, "reads 123.456 mm"), "datum", "none", "4711");
    status.verified = 1;
    store_->Outcome(status, At(1.5));
    CommandRecord second = Command(0xa2, "axis2");
    second.who = "unsigned";
    second.key_id = 0;
    second.utime = kStart + 3'600'000'000;
    EXPECT_TRUE(store_->Accepted(second, At(3600)));
    status = Moved(second.status, S::STATE_INDETERMINATE, "the driver fell silent \x1b[2J");
    status.reason_code = S::REASON_DRIVER_SILENT;
    status.finding = S::FINDING_EFFECT_SEEN;
    store_->Outcome(status, At(3601));
    EXPECT_TRUE(store_->Accepted(Command(0xb3), At(7200)));
    store_->Note({kStart + 1'800'000'000, "axis1", "moved_while_off", "by 0.7 turns"});
    EXPECT_TRUE(store_->Apply("axis1", DatumRecord{.counts = 1,
                                                   .utime = kStart,
                                                   .identity = {},
                                                   .value = "0 mm",
                                                   .who = "local",
                                                   .reason = {},
                                                   .void_reason = {}}));
    EXPECT_TRUE(store_->Apply("axis1", DatumRecord{.counts = 4711,
                                                   .utime = kStart,
                                                   .identity = {},
                                                   .value = "123.456 mm",
                                                   .who = "plc",
                                                   .command = NumberedId(0xa1),
                                                   .reason = "homing",
                                                   .void_reason = {}}));
    EXPECT_TRUE(store_->Apply("axis2", WritesAdded{50, kStart}));
    EXPECT_TRUE(store_->Apply("axis2", ReferenceChanged{true}));
    store_->KeepPosition("axis2", {.counts = -7, .utime = kStart});
    store_->Tick(At(7200));
    std::ofstream(machine_) << kMachine;
  }

  // As main has it.
  static int Parse(std::vector<std::string> words) {
    CLI::App app("test", "axlecast");
    int exit_code = kExitDone;
    AddHistoryCommand(app, exit_code);
    AddDatumCommands(app, exit_code);
    std::reverse(words.begin(), words.end());  // as CLI::App::parse requires
    try {
      app.parse(words);
    } catch (const CLI::ParseError& error) {
      return error.get_exit_code() == 0 ? kExitDone : kExitUsage;
    }
    return exit_code;
  }
  Result Run(std::vector<std::string> words) const {
    words.insert(words.end(), {"--journal", file_});
    return RunWith(words);
  }
  static Result RunWith(const std::vector<std::string>& words) {
    Result result;
    ::testing::internal::CaptureStdout();
    ::testing::internal::CaptureStderr();
    result.exit_code = Parse(words);
    result.out = ::testing::internal::GetCapturedStdout();
    result.err = ::testing::internal::GetCapturedStderr();
    return result;
  }

  std::unique_ptr<SqliteStore> store_;
  const std::string machine_ = folder_.path() + "/machine.yaml";
};

TEST_F(JournalCommands, HistoryIsATableOldestFirst) {
  const Result result = Run({"history"});
  EXPECT_EQ(result.exit_code, kExitDone);
  EXPECT_EQ(
      result.out,
      "time (UTC)          id       who        device     operation                        outcome       text\n"
      "2023-11-14 22:13:20 a1000000 plc        axis1      set_datum value=123.456          succeeded     "
      "verified: reads 123.456 mm\n"
      "2023-11-14 22:13:20 b3000000 plc        axis1      set_datum value=123.456          accepted\n"
      "2023-11-14 23:13:20 a2000000 unsigned   axis2      set_datum value=123.456          indeterminate "
      "effect_seen, driver_silent: the driver fell silent ?[2J\n");
  EXPECT_EQ(result.err, "");
}

TEST_F(JournalCommands, HistoryTakesFilters) {
  const auto count = [&](std::vector<std::string> words) {
    words.insert(words.begin(), "history");
    words.emplace_back("--json");
    return Run(words).Objects().size();
  };
  EXPECT_EQ(count({}), 3U);
  EXPECT_EQ(count({"--device", "axis2"}), 1U);
  EXPECT_EQ(count({"--operation", "set_datum", "--who", "plc"}), 2U);
  EXPECT_EQ(count({"--outcome", "indeterminate"}), 1U);
  EXPECT_EQ(count({"--outcome", "accepted"}), 1U);
  EXPECT_EQ(count({"--since", "2023-11-14T23:00", "--until", "2023-11-15"}), 1U);
  EXPECT_EQ(count({"--since", "2h"}), 0U) << "that was years ago";
  EXPECT_EQ(count({"--limit", "2"}), 2U);
  EXPECT_EQ(count({"--limit", "0"}), 3U);
  EXPECT_EQ(count({"--events"}), 4U);
  EXPECT_EQ(count({"--events", "--device", "axis2"}), 1U);
  EXPECT_THAT(Run({"history", "--limit", "2"}).err, StartsWith("the newest 2; --limit N shows more"));
  EXPECT_THAT(Run({"history", "--device", "axis7"}).err, StartsWith("the journal contains no such entry"));
  EXPECT_EQ(Run({"history", "--device", "axis7"}).exit_code, kExitDone);
  EXPECT_THAT(
      Run({"history", "--events"}).out,
      HasSubstr("\n2023-11-14 22:43:20 -        -          axis1      moved_while_off                  event  "
                "       by 0.7 turns\n2023-11-14 23:13:20 a2"));
}

TEST_F(JournalCommands, OneCommandIsToldWhole) {
  const Result result = Run({"history", "A1"});
  EXPECT_EQ(result.exit_code, kExitDone);
  EXPECT_EQ(result.out,
            "id        a1000000000000000000000000000000\n"
            "command   axis1 set_datum value=123.456\n"
            "who       plc (key 8000000000000000)\n"
            "reason    homing\n"
            "accepted  2023-11-14 22:13:20.000 UTC, to begin until 2023-11-14 22:13:25.000\n"
            "outcome   succeeded, verified: reads 123.456 mm\n"
            "changes\n"
            "  datum: none -> 4711\n"
            "steps\n"
            "  2023-11-14 22:13:20.000  accepted\n"
            "  2023-11-14 22:13:20.001  routed\n"
            "  2023-11-14 22:13:20.002  running       waits for standstill\n"
            "  2023-11-14 22:13:21.500  succeeded     verified: reads 123.456 mm\n");
  const auto json = Run({"history", "a1", "--json"}).Objects().at(0);
  EXPECT_EQ(json["outcome"], "succeeded");
  EXPECT_EQ(json["arguments"][0]["value"], "123.456");
  EXPECT_EQ(json["client_reason"], "homing");
  EXPECT_EQ(json["changes"][0]["after"], "4711");
  EXPECT_EQ(json["steps"].size(), 4U);
  EXPECT_EQ(json["steps"][2]["state"], "running");
  EXPECT_THAT(Run({"history", "b3"}).out, HasSubstr("outcome   none yet, accepted\n"));
}

TEST_F(JournalCommands, WhatIsNoUniqueIdIsTold) {
  const Result several = Run({"history", "a"});
  EXPECT_EQ(several.exit_code, kExitBad);
  EXPECT_THAT(several.err, AllOf(HasSubstr("several ids begin with a:"),
                                 HasSubstr("\n  a2000000000000000000000000000000"), Not(HasSubstr("b3"))));
  EXPECT_EQ(Run({"history", "ff"}).exit_code, kExitBad);
  EXPECT_EQ(Run({"history", "axis1"}).exit_code, kExitUsage);
  EXPECT_EQ(Run({"history", std::string(33, 'a')}).exit_code, kExitUsage);
}

TEST_F(JournalCommands, WrongUsage) {
  EXPECT_EQ(Run({"history", "--since", "yesterday"}).exit_code, kExitUsage);
  EXPECT_THAT(Run({"history", "--until", "yesterday"}).err, HasSubstr("'yesterday' is no time: write 90s"));
  EXPECT_EQ(Run({"history", "--outcome", "good"}).exit_code, kExitUsage);
  EXPECT_EQ(Run({"history", "--limit", "-1"}).exit_code, kExitUsage);
  EXPECT_EQ(Run({"history", "a1", "--follow"}).exit_code, kExitUsage);
  EXPECT_EQ(Run({"history", "--events", "--who", "plc"}).exit_code, kExitUsage);
  EXPECT_EQ(Run({"datum"}).exit_code, kExitUsage);
  EXPECT_EQ(Run({"datum", "history"}).exit_code, kExitUsage);
}

TEST_F(JournalCommands, AJournalThatIsNotThereIsTold) {
  const std::string missing = folder_.path() + "/missing.db";
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"history"}, {"history", "a1"}, {"datum", "show"}, {"datum", "history", "axis1"}}) {
    std::vector<std::string> command = words;
    command.insert(command.end(), {"--journal", missing});
    const Result result = RunWith(command);
    EXPECT_EQ(result.exit_code, kExitBad);
    EXPECT_THAT(result.err, StartsWith(missing + " does not exist: the bridge writes it"));
    EXPECT_EQ(result.out, "");
  }
}

TEST_F(JournalCommands, TheMachinesFileSaysWhere) {
  setenv("STATE_DIRECTORY", (folder_.path() + "/state").c_str(), 1);
  const Result result = RunWith({"history", "--config", machine_, "--json"});
  unsetenv("STATE_DIRECTORY");
  EXPECT_EQ(result.Objects().size(), 3U) << result.err;
}

TEST_F(JournalCommands, DatumShowTellsOfEachDevice) {
  const Result result = Run({"datum", "show"});
  EXPECT_EQ(result.exit_code, kExitDone);
  EXPECT_EQ(
      result.out,
      "axis1\n"
      "  datum      2: read 123.456 mm, counts 4711 are 0, set 2023-11-14 22:13:20 UTC by plc, command a1000000: "
      "homing\n"
      "  reference  not lost\n"
      "  position   unknown\n"
      "  wear       0 writes\n"
      "axis2\n"
      "  datum      none\n"
      "  reference  LOST\n"
      "  position   counts -7 at 2023-11-14 22:13:20 UTC, before the datum\n"
      "  wear       50 writes since 2023-11-14 22:13:20 UTC\n");
  const auto json = Run({"datum", "show", "axis1", "--json"}).Objects().at(0);
  EXPECT_EQ(json["datum"]["counts"], 4711);
  EXPECT_TRUE(json["position"].is_null());
  EXPECT_EQ(json["reference_lost"], false);
  EXPECT_TRUE(json["write_budget"].is_null());
  EXPECT_EQ(Run({"datum", "show", "axis7"}).exit_code, kExitBad);
  EXPECT_EQ(Run({"datum", "show", "axis7", "--config", machine_}).exit_code, kExitUsage);
}

TEST_F(JournalCommands, DatumHistoryTellsOfEachDatum) {
  ASSERT_TRUE(store_->Apply("axis1", DatumVoided{kStart + 60'000'000, "zeroed in the device"}));
  const Result result = Run({"datum", "history", "axis1"});
  EXPECT_EQ(result.exit_code, kExitDone);
  EXPECT_EQ(result.out,
            "number set (UTC)                    reading    counts of 0 who        command  state\n"
            "     2 2023-11-14 22:13:20       123.456 mm           4711 plc        a1000000 void since 2023-11-14 "
            "22:14:20: zeroed in the device (homing)\n"
            "     1 2023-11-14 22:13:20             0 mm              1 local      -        replaced\n");
  const auto objects = Run({"datum", "history", "axis1", "--json"}).Objects();
  ASSERT_EQ(objects.size(), 2U);
  EXPECT_EQ(objects[0]["voided_why"], "zeroed in the device");
  EXPECT_TRUE(objects[1]["voided_utime"].is_null());
  EXPECT_EQ(Run({"datum", "history", "axis2"}).exit_code, kExitDone);
  EXPECT_EQ(Run({"datum", "history", "axis7"}).exit_code, kExitBad);
  EXPECT_EQ(Run({"datum", "history", "axis7", "--config", machine_}).exit_code, kExitUsage);
}

TEST_F(JournalCommands, FollowTellsEachAsItEnds) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  const pid_t child = fork();
  if (child == 0) {
    dup2(ends[1], STDOUT_FILENO);
    close(ends[1]);
    _exit(Parse({"history", "--follow", "--events", "--limit", "1", "--journal", file_}));
  }
  ASSERT_GT(child, 0);
  close(ends[1]);
  FILE* const lines = fdopen(ends[0], "r");
  std::array<char, 400> line{};
  const auto next = [&] { return fgets(line.data(), line.size(), lines) == nullptr ? "" : line.data(); };
  EXPECT_THAT(next(), StartsWith("time (UTC)"));
  EXPECT_THAT(next(), HasSubstr("a2000000"));
  store_->Outcome(Moved(Command(0xb3).status, S::STATE_FAILED, "no"), At(7201));
  EXPECT_THAT(next(),
              HasSubstr("b3000000 plc        axis1      set_datum value=123.456          failed        no"));
  store_->Note({kStart, "", "bridge_started", "text"});
  EXPECT_THAT(next(), HasSubstr("bridge_started"));
  ASSERT_EQ(kill(child, SIGINT), 0);
  int status = -1;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == kExitDone) << status;
  EXPECT_EQ(std::string(next()), "");
  fclose(lines);
}

}  // namespace
}  // namespace axlecast
