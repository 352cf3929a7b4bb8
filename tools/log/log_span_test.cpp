#include "tools/log/log_span.h"

#include <gtest/gtest.h>

#include "tools/log/log_header.h"
#include "tools/log/recorded_log.h"

namespace axlecast {
namespace {

TEST(LogSpan, IsFromTheFirstMessageToTheLastEvent) {
  const RecordedLog one =
      RecordedLog().Add(90, std::string(kMachineChannel)).Add(20, "a").Add(70, "b").AddDamage(100);
  const RecordedLog other = RecordedLog().Add(10, "x").Add(30, "y");
  EXPECT_EQ(SpanOf({one.bytes()}).first, 20);
  EXPECT_EQ(SpanOf({one.bytes(), other.bytes()}).first, 10);
  EXPECT_EQ(SpanOf({other.bytes(), one.bytes()}).last, 70);
  EXPECT_EQ(SpanOf({Bytes()}).first, 0);
  EXPECT_EQ(SpanOf({Bytes()}).last, 0);
}

TEST(LogSpan, FindsTheLastEventOfALargeLog) {
  RecordedLog log;
  for (int i = 0; i < 50; ++i) log.Add(i, "large", std::string(10'000, 'x'));
  EXPECT_EQ(SpanOf({log.bytes()}).last, 49);
  EXPECT_EQ(SpanOf({log.Add(60, "huge", std::string(500'000, 'x')).bytes()}).last, 60);
}

}  // namespace
}  // namespace axlecast
