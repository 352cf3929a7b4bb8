#include "tools/log/shipped_logs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "tests/support/temporary_folder.h"
#include "tools/log/log_holes.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;

TEST(FormatShippedLogs, IsOneJsonObject) {
  const ShippedLogs shipped{.logs = {{"b.lcm", {7, false, 2}}, {"a.lcm", {1'200, true, 0}}}, .utime = 5};
  EXPECT_EQ(
      FormatShippedLogs(shipped),
      R"({"logs":{"a.lcm":{"upto":1200,"complete":true},"b.lcm":{"upto":7,"complete":false,"hole":2}},"utime":5})"
      "\n");
}

TEST(ParseShippedLogs, ReadsWhatTheDesignShows) {
  const auto shipped = ParseShippedLogs(
      R"({"utime": 9, "later": [1], "logs": {"press3-positions_20261121T070005Z.lcm": {"complete": true, "upto": 3}}})");
  ASSERT_TRUE(shipped) << shipped.error().text;
  EXPECT_EQ(shipped->utime, 9);
  EXPECT_THAT(shipped->logs, ElementsAre(Pair("press3-positions_20261121T070005Z.lcm", ShippedLog{3, true, 0})));
  EXPECT_EQ(shipped->Of("press3-positions_20261121T070005Z.lcm.zst"), (ShippedLog{3, true, 0}));
  EXPECT_EQ(shipped->Of("other.lcm"), ShippedLog());
}

TEST(ParseShippedLogs, RefusesWhatIsDamaged) {
  for (const char* text :
       {"", "{", "[]", "null", "{}", R"({"logs":{}})", R"({"utime":1})", R"({"logs":[],"utime":1})",
        R"({"logs":{},"utime":-1})", R"({"logs":{},"utime":1.5})", R"({"logs":{},"utime":18446744073709551615})",
        R"({"logs":{"a":1},"utime":1})", R"({"logs":{"a":{"upto":1}},"utime":1})",
        R"({"logs":{"a":{"complete":true}},"utime":1})", R"({"logs":{"a":{"upto":-1,"complete":true}},"utime":1})",
        R"({"logs":{"a":{"upto":1,"complete":1}},"utime":1})",
        R"({"logs":{"a":{"upto":1,"complete":true,"hole":-1}},"utime":1})",
        R"({"logs":{"a":{"upto":1,"complete":true}},"utime":1)"}) {
    EXPECT_FALSE(ParseShippedLogs(text)) << text;
  }
  EXPECT_TRUE(ParseShippedLogs(R"({"logs":{},"utime":9223372036854775807})"));
}

class MarkShippedTest : public ::testing::Test {
 protected:
  void Store(const std::string& file, const std::string& content = "") const {
    std::ofstream(folder_.path() + '/' + file) << content;
  }
  [[nodiscard]] std::map<std::string, ShippedLog, std::less<>> Logs() const {
    const auto shipped = ReadShippedLogs(folder_.path());
    EXPECT_TRUE(shipped) << shipped.error().text;
    return shipped ? shipped->logs : std::map<std::string, ShippedLog, std::less<>>();
  }

  const TemporaryFolder folder_;
};

TEST_F(MarkShippedTest, NothingIsShippedWithoutAFile) {
  const auto shipped = ReadShippedLogs(folder_.path());
  ASSERT_TRUE(shipped);
  EXPECT_TRUE(shipped->logs.empty());
}

TEST_F(MarkShippedTest, ADamagedFileIsReportedAndReplaced) {
  Store("a.lcm");
  Store("shipped.json", R"({"logs":{"a.lcm":{"upto":1,"comp)");
  const auto shipped = ReadShippedLogs(folder_.path());
  ASSERT_FALSE(shipped);
  EXPECT_THAT(shipped.error().text, HasSubstr("/shipped.json is damaged"));
  EXPECT_THAT(shipped.error().text, HasSubstr("nothing counts as shipped"));
  EXPECT_TRUE(MarkShipped(folder_.path(), {.logs = {{"a.lcm", {4, false, 0}}}, .utime = 8}));
  EXPECT_THAT(Logs(), ElementsAre(Pair("a.lcm", ShippedLog{4, false, 0})));
}

TEST_F(MarkShippedTest, ChangesItsEntriesAndKeepsThoseOfOthers) {
  Store("a.lcm");
  Store("b.lcm.zst");
  ASSERT_TRUE(MarkShipped(folder_.path(), {.logs = {{"a.lcm", {1, false, 0}}}, .utime = 1}));
  ASSERT_TRUE(MarkShipped(folder_.path(), {.logs = {{"b.lcm", {2, true, 0}}}, .utime = 2}));
  ASSERT_TRUE(MarkShipped(folder_.path(), {.logs = {{"a.lcm", {3, true, 0}}}, .utime = 3}));
  EXPECT_THAT(Logs(), ElementsAre(Pair("a.lcm", ShippedLog{3, true, 0}), Pair("b.lcm", ShippedLog{2, true, 0})));
  EXPECT_EQ(ReadShippedLogs(folder_.path())->utime, 3);
  struct stat status {};
  ASSERT_EQ(stat((folder_.path() + "/shipped.json").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0644U) << "the recorder may be another user";
}

TEST_F(MarkShippedTest, RemovesLogsThatAreGone) {
  Store("a.lcm");
  Store("b.lcm");
  ASSERT_TRUE(
      MarkShipped(folder_.path(), {.logs = {{"a.lcm", {1, true, 0}}, {"b.lcm", {1, false, 0}}}, .utime = 1}));
  LogHole hole;
  hole.file = "b.lcm";
  ASSERT_TRUE(AppendHole(folder_.path(), hole));
  for (const char* file : {"a.lcm", "b.lcm"}) std::filesystem::remove(folder_.path() + '/' + file);
  ASSERT_TRUE(MarkShipped(folder_.path(), {.logs = {}, .utime = 2}));
  EXPECT_THAT(Logs(), ElementsAre(Pair("b.lcm", ShippedLog{1, false, 0}))) << "a hole needs its entry";
}

TEST_F(MarkShippedTest, OneWriterAtATime) {
  Store("a.lcm");
  {
    const auto lock = LockOutbox(folder_.path());
    ASSERT_TRUE(lock);
    const Result<> marked = MarkShipped(folder_.path(), {.logs = {{"a.lcm", {1, true, 0}}}, .utime = 1});
    ASSERT_FALSE(marked);
    EXPECT_THAT(marked.error().text, HasSubstr("is locked by another process"));
    LogHole hole;
    hole.file = "a.lcm";
    EXPECT_FALSE(AppendHole(folder_.path(), hole));
    EXPECT_FALSE(WithdrawHoles(folder_.path()));
    EXPECT_FALSE(std::filesystem::exists(folder_.path() + "/holes.jsonl"));
  }
  EXPECT_TRUE(MarkShipped(folder_.path(), {.logs = {{"a.lcm", {1, true, 0}}}, .utime = 1}));
  EXPECT_FALSE(MarkShipped(folder_.path() + "/nowhere", {}));
}

}  // namespace
}  // namespace axlecast
