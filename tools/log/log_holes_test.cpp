#include "tools/log/log_holes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "core/base/text.h"
#include "tests/support/temporary_folder.h"
#include "tools/log/log_event.h"
#include "tools/log/log_name.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr const char* kLine =
    R"({"file":"m-events_20261121T070005Z.lcm","logs":1,"name":"events","host":"press3","start_utime":1795244405000000,)"
    R"("file_number":2,"first_event":1200,"last_utime":1795244505000000,"bytes":4096,"cause":"disk nearly full",)"
    R"("utime":1795249999000000})";

LogHole Hole(const std::string& file = "m-events_20261121T070005Z.lcm") {
  LogHole hole;
  hole.file = file;
  hole.name = "events";
  hole.host = "press3";
  hole.start_utime = 1'795'244'405'000'000;
  hole.file_number = 2;
  hole.first_event = 1'200;
  hole.last_utime = 1'795'244'505'000'000;
  hole.bytes = 4'096;
  hole.cause = "disk nearly full";
  hole.utime = 1'795'249'999'000'000;
  return hole;
}

TEST(LogHole, IsALineOfJson) {
  EXPECT_EQ(FormatHole(Hole()), std::string(kLine) + '\n');
  EXPECT_EQ(ParseHole(kLine), Hole());
}

TEST(LogHole, NothingElseIsAHole) {
  const std::string line = kLine;
  for (std::size_t size = 0; size < line.size(); ++size) EXPECT_FALSE(ParseHole(line.substr(0, size))) << size;
  for (const auto& [from, to] : {std::pair("\"logs\":1", "\"logs\":0"),
                                 {"\"bytes\":4096", "\"bytes\":-1"},
                                 {"4096", "\"4096\""},
                                 {"m-events_2", "/m-events_2"},
                                 {"m-events_20261121T070005Z.lcm", ""},
                                 {"\"events\"", "7"},
                                 {"\"utime\"", "\"udate\""},
                                 {"\"cause\"", "\"reason\""}}) {
    std::string changed = line;
    changed.replace(changed.find(from), std::string_view(from).size(), to);
    EXPECT_FALSE(ParseHole(changed)) << changed;
  }
}

TEST(LogHole, HasTheIdentityOfTheLog) {
  std::vector<std::uint8_t> log;
  const std::string head = R"({"version":"1","name":"events","host":"press3","start_utime":17,"file_number":2})";
  AppendEvent(log, {0, 1, kRecorderChannel, AsBytes(head)});
  AppendEvent(log, {1, 1, "A", {}});
  LogHole expected;
  expected.name = "events";
  expected.host = "press3";
  expected.start_utime = 17;
  expected.file_number = 2;
  EXPECT_EQ(HoleOf(log), expected);
  EXPECT_EQ(HoleOf(Bytes(log).first(log.size() - 1)), expected);
  EXPECT_EQ(HoleOf(Bytes(log).first(50)), LogHole());
  log.clear();
  AppendEvent(log, {0, 1, kRecorderChannel, AsBytes("[1]")});
  EXPECT_EQ(HoleOf(log), LogHole()) << "no object";
  log.clear();
  AppendEvent(log, {0, 1, kRecorderChannel, AsBytes(R"({"name":7,"host":"h","start_utime":-1})")});
  expected = LogHole();
  expected.host = "h";
  EXPECT_EQ(HoleOf(log), expected);
}

class LogHolesTest : public ::testing::Test {
 protected:
  void Store(const std::string& file, const std::string& content = "") const {
    std::ofstream(folder_.path() + '/' + file) << content;
  }
  [[nodiscard]] std::string Lines() const {
    std::ifstream file(folder_.path() + "/holes.jsonl");
    return {std::istreambuf_iterator<char>(file), {}};
  }
  [[nodiscard]] std::vector<std::string> Holes(const ShippedLogs& shipped = {}) const {
    std::vector<std::string> files;
    const auto holes = ReadHoles(folder_.path(), shipped);
    EXPECT_TRUE(holes) << holes.error().text;
    for (const LogHole& hole : *holes) files.push_back(hole.file);
    return files;
  }
  void Append(const LogHole& hole) const {
    const Result<> appended = AppendHole(folder_.path(), hole);
    EXPECT_TRUE(appended) << appended.error().text;
  }

  const TemporaryFolder folder_;
};

TEST_F(LogHolesTest, AreTheLinesOfLogsThatAreGone) {
  EXPECT_THAT(Holes(), IsEmpty());
  Store("a.lcm");
  Store("b.lcm.zst");
  for (const char* file : {"a.lcm", "b.lcm", "c.lcm"}) Append(Hole(file));
  EXPECT_THAT(Holes(), ElementsAre("c.lcm")) << "the recorder was killed before it deleted the others";
  std::filesystem::remove(folder_.path() + "/b.lcm.zst");
  EXPECT_THAT(Holes(), ElementsAre("b.lcm", "c.lcm"));
}

TEST_F(LogHolesTest, ALogThatIsStillThereIsNoHoleAfterARestart) {
  Store("a.lcm");
  Append(Hole("a.lcm"));
  Append(Hole("b.lcm"));
  ASSERT_TRUE(WithdrawHoles(folder_.path()));
  std::filesystem::remove(folder_.path() + "/a.lcm");  // it was shipped meanwhile
  EXPECT_THAT(Holes(), ElementsAre("b.lcm"));
  EXPECT_TRUE(WithdrawHoles(folder_.path())) << "nothing to do";
}

TEST_F(LogHolesTest, TheFolderIsLockedUntilTheLogIsDeleted) {
  Store("a.lcm");
  ASSERT_TRUE(AppendHole(folder_.path(), Hole("a.lcm"), [&]() -> Result<> {
    EXPECT_FALSE(WithdrawHoles(folder_.path())) << "by another recorder that starts";
    EXPECT_EQ(Lines(), FormatHole(Hole("a.lcm")));
    std::filesystem::remove(folder_.path() + "/a.lcm");
    return {};
  }));
  EXPECT_THAT(Holes(), ElementsAre("a.lcm"));
}

TEST_F(LogHolesTest, ALogThatCannotBeDeletedIsNoHole) {
  Store("a.lcm");
  const Result<> appended = AppendHole(folder_.path(), Hole("a.lcm"), [] { return Result<>(Failure("no right")); });
  ASSERT_FALSE(appended);
  EXPECT_EQ(appended.error().text, "no right");
  EXPECT_EQ(Lines(), "");
}

TEST_F(LogHolesTest, TheDatabaseHasSome) {
  for (const char* file : {"a.lcm", "b.lcm", "c.lcm", "d.lcm"}) Append(Hole(file));
  EXPECT_THAT(Holes({.logs = {{"a.lcm", {5, true, 0}}, {"b.lcm", {5, false, 0}}, {"c.lcm", {5, false, 1}}}}),
              ElementsAre("b.lcm", "d.lcm"));
}

TEST_F(LogHolesTest, TheLastLineOfALogCounts) {
  Append(Hole("a.lcm"));
  Append(Hole("b.lcm"));
  LogHole again = Hole("a.lcm");
  again.first_event = 9'999;
  Append(again);
  EXPECT_EQ(ReadHoles(folder_.path(), {}), (std::vector{again, Hole("b.lcm")}));
}

TEST_F(LogHolesTest, ATornLineIsIgnoredAndHarmsNoOther) {
  Append(Hole("a.lcm"));
  for (const std::size_t size : {1U, 20U, 200U}) {
    Store("holes.jsonl", FormatHole(Hole("a.lcm")) + FormatHole(Hole("torn.lcm")).substr(0, size));
    EXPECT_THAT(Holes(), ElementsAre("a.lcm"));
    Append(Hole("b.lcm"));
    EXPECT_THAT(Holes(), ElementsAre("a.lcm", "b.lcm")) << Lines();
  }
  // Complete but for its newline: its sync has not returned, and its log was not deleted.
  Store("holes.jsonl", kLine);
  EXPECT_THAT(Holes(), IsEmpty());
}

TEST_F(LogHolesTest, DamagedLinesAreIgnored) {
  Store("holes.jsonl", "\n\n{}\n" + std::string("\0\xFF\n", 3) + FormatHole(Hole("a.lcm")) + "x\n");
  EXPECT_THAT(Holes(), ElementsAre("a.lcm"));
}

TEST_F(LogHolesTest, AFileThatCannotBeReadIsAnError) {
  std::filesystem::create_directory(folder_.path() + "/holes.jsonl");
  EXPECT_FALSE(ReadHoles(folder_.path(), {}));
  EXPECT_FALSE(LogsOfHoles(folder_.path()));
  EXPECT_FALSE(AppendHole(folder_.path(), Hole()));
  EXPECT_FALSE(WithdrawHoles(folder_.path()));
  EXPECT_FALSE(ReserveHoles(folder_.path()));
}

TEST_F(LogHolesTest, SpaceForLaterLinesIsReserved) {
  ASSERT_TRUE(ReserveHoles(folder_.path()));
  EXPECT_EQ(Lines(), "");
  EXPECT_THAT(Holes(), IsEmpty());
}

// Also without a shipper, for years.
TEST_F(LogHolesTest, TheFileStaysSmall) {
  std::int64_t utime = 1'795'244'405'000'000;
  std::int64_t count = 0;
  const auto next = [&] {
    LogHole hole = Hole(LogFileName(count++ % 2 == 0 ? "m-events" : "m-positions", utime, 0));
    hole.last_utime = utime += 1'000'000;
    return hole;
  };
  for (int year = 0; year < 5; ++year) {
    std::string text = Lines();
    while (text.size() <= kMaxHolesBytes) text += FormatHole(next());
    Store("holes.jsonl", text);
    Append(next());
    ASSERT_LE(Lines().size(), kMaxHolesBytes * 3 / 4) << year;
  }
  const auto holes = ReadHoles(folder_.path(), {});
  ASSERT_TRUE(holes);
  std::int64_t logs = 0;
  std::int64_t bytes = 0;
  for (const LogHole& hole : *holes) {
    logs += hole.logs;
    bytes += hole.bytes;
  }
  EXPECT_EQ(logs, count);
  EXPECT_EQ(bytes, count * 4'096);
  EXPECT_GT(holes->front().logs, 100);
  EXPECT_EQ(holes->front().file, LogFileName("m-events", 1'795'244'405'000'000, 0));
  EXPECT_EQ(holes->back().logs, 1);
}

TEST_F(LogHolesTest, WhatTheDatabaseHasGoesFirst) {
  ShippedLogs shipped;
  std::string text;
  for (int i = 0; text.size() <= kMaxHolesBytes; ++i) {
    const std::string file = "a" + std::to_string(i) + ".lcm";
    text += FormatHole(Hole(file));
    if (i != 3) shipped.logs[file] = {0, false, 1};
  }
  Store("holes.jsonl", text);
  ASSERT_TRUE(MarkShipped(folder_.path(), shipped));
  Append(Hole("z.lcm"));
  EXPECT_THAT(Holes(), ElementsAre("a3.lcm", "z.lcm"));
  EXPECT_EQ(Lines(), FormatHole(Hole("a3.lcm")) + FormatHole(Hole("z.lcm")));
}

TEST(JoinHoles, JoinsTheOlderHalfPerRecorder) {
  std::vector<LogHole> holes;
  for (int i = 0; i < 8; ++i) {
    LogHole hole = Hole(LogFileName(i % 2 == 0 ? "a" : "b", 1'795'244'405'000'000 + i * 1'000'000, 0));
    hole.last_utime = 100 + i;
    hole.utime = 200 + i;
    hole.first_event = i;
    hole.bytes = 10 + i;
    holes.push_back(hole);
  }
  holes[2].last_utime = 50;  // its clock was wrong
  const std::vector<LogHole> joined = JoinHoles(holes);
  ASSERT_THAT(joined, SizeIs(6));
  EXPECT_EQ(joined[0].file, holes[0].file);
  EXPECT_EQ(joined[0].logs, 2);
  EXPECT_EQ(joined[0].first_event, 0);
  EXPECT_EQ(joined[0].last_utime, 100);
  EXPECT_EQ(joined[0].bytes, 22);
  EXPECT_EQ(joined[0].utime, 202);
  EXPECT_EQ(joined[1].file, holes[1].file);
  EXPECT_EQ(joined[1].last_utime, 103);
  EXPECT_EQ(joined[1].bytes, 24);
  for (std::size_t i = 2; i < joined.size(); ++i) EXPECT_EQ(joined[i], holes[i + 2]);
  LogHole elsewhere = holes[2];
  elsewhere.host = "press4";
  EXPECT_THAT(JoinHoles({holes[0], elsewhere, holes[4], holes[6]}), SizeIs(4)) << "of another host";
}

// The database has the row of one log. More logs were joined to it since.
TEST_F(LogHolesTest, AHoleThatHasGrownIsOpenAgain) {
  LogHole hole = Hole("a.lcm");
  hole.logs = 40;
  Append(hole);
  EXPECT_THAT(Holes({.logs = {{"a.lcm", {5, false, 1}}}}), ElementsAre("a.lcm"));
  EXPECT_THAT(Holes({.logs = {{"a.lcm", {5, false, 40}}}}), IsEmpty());
}

}  // namespace
}  // namespace axlecast
