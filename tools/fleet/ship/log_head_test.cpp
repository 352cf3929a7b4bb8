#include "tools/fleet/ship/log_head.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/log/log_fixture.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;

constexpr const char* kRecorder =
    R"({"version":"1","name":"positions","host":"plc1","start_utime":1790000000000000,"file_number":3})";

std::string Mistake(const ScriptedLog& log) { return ReadLogHead(log.bytes()).error().text; }

TEST(ReadLogHead, ReadsTheIdentityAndTheMachinesFile) {
  ScriptedLog log;
  log.Add(kRecorderChannel, kRecorder)
      .Add(kMachineChannel, "machine: press3\n")
      .Add(kSchemaChannel, "x")
      .Add("A", "b");
  const Result<LogHead> head = ReadLogHead(log.bytes());
  ASSERT_TRUE(head);
  EXPECT_EQ(head->key, (LogKey{"positions", "plc1", 1'790'000'000'000'000, 3}));
  EXPECT_EQ(head->machine, "machine: press3\n");
}

TEST(ReadLogHead, RefusesOtherLogs) {
  EXPECT_THAT(Mistake(ScriptedLog()), HasSubstr("does not begin with the head"));
  EXPECT_THAT(Mistake(ScriptedLog().Add("A", "b").Add(kRecorderChannel, kRecorder)), HasSubstr("does not begin"));
  EXPECT_THAT(Mistake(ScriptedLog().Add(kRecorderChannel, kRecorder).Add("A", "b")),
              HasSubstr("no machine's file"));
  for (const char* damaged : {"", "{", "[]", R"({"name":1,"host":"a","start_utime":1,"file_number":0})",
                              R"({"name":"a","host":"a","start_utime":-1,"file_number":0})",
                              R"({"name":"a","host":"a","start_utime":1.5,"file_number":0})",
                              R"({"name":"a","host":"a","start_utime":1,"file_number":4294967296})",
                              R"({"name":"a","host":"a","start_utime":18446744073709551615,"file_number":0})"}) {
    EXPECT_THAT(Mistake(ScriptedLog().Add(kRecorderChannel, damaged).Add(kMachineChannel, "m")),
                HasSubstr("damaged"))
        << damaged;
  }
}

}  // namespace
}  // namespace axlecast
