#include "tools/log/log_merge.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace axlecast {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

std::vector<std::uint8_t> Log(const std::vector<std::int64_t>& times) {
  std::vector<std::uint8_t> log;
  for (std::int64_t number = 0; const std::int64_t utime : times) {
    AppendEvent(log, {.number = number++, .utime = utime, .channel = "A", .data = {}});
  }
  return log;
}

// "log:time" of each.
std::vector<std::string> Merged(const std::vector<std::vector<std::uint8_t>>& logs) {
  std::vector<LogReader> readers;
  for (const auto& log : logs) readers.emplace_back(log);
  LogMerge merge(std::move(readers));
  std::vector<std::string> merged;
  for (auto next = merge.Next(); next; next = merge.Next()) {
    merged.push_back(std::to_string(next->log) + ':' + std::to_string(next->event.utime));
  }
  return merged;
}

TEST(LogMerge, IsByTimeAndThenByLog) {
  EXPECT_THAT(Merged({Log({1, 4, 4}), Log({2, 4}), Log({0, 9})}),
              ElementsAre("2:0", "0:1", "1:2", "0:4", "0:4", "1:4", "2:9"));
}

TEST(LogMerge, OfNothingIsNothing) {
  EXPECT_THAT(Merged({}), IsEmpty());
  EXPECT_THAT(Merged({Log({}), Log({})}), IsEmpty());
}

TEST(LogMerge, KeepsALogsOwnOrder) {
  EXPECT_THAT(Merged({Log({5, 3, 7}), Log({4, 6})}), ElementsAre("1:4", "0:5", "0:3", "1:6", "0:7"));
}

TEST(LogMerge, GoesOnPastDamage) {
  std::vector<std::uint8_t> damaged = Log({1, 2, 3});
  damaged[30] = 0;
  EXPECT_THAT(Merged({damaged, Log({2})}), ElementsAre("0:1", "1:2", "0:3"));
}

}  // namespace
}  // namespace axlecast
