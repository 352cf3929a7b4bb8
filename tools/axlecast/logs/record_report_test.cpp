#include "tools/axlecast/logs/record.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tools/axlecast/common/terminal.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(RecordReport, AWholeRecordingIsDone) {
  RecordingStatus status;
  status.messages = 1'234;
  status.bytes = 5'600'000;
  status.disk.file = "a.lcm";
  EXPECT_EQ(RecordExitCode(status), kExitDone);
  EXPECT_EQ(RecordSummary(status), "1234 messages, 5.6 MB, last in a.lcm\nnothing was lost\n");
  EXPECT_TRUE(nlohmann::json::parse(RecordEndJson("events", status))["whole"]);
}

TEST(RecordReport, LossesAreToldByTheirCause) {
  RecordingStatus status;
  status.receiver.lost = 5;
  status.receiver.overflow = 2;
  status.receiver.kernel_dropped = 9;
  status.receiver.senders = {{SenderAddress::OfIPv4(0x7f000001, 40'001), 100, 7, 0}};
  status.channels = {{"POSITION/axis1", 90, 5}};
  EXPECT_EQ(RecordExitCode(status), kExitLosses);
  const std::string text = RecordSummary(status);
  EXPECT_THAT(text, HasSubstr("5 missing by the senders' sequence numbers"));
  EXPECT_THAT(text, HasSubstr("2 found no space in memory"));
  EXPECT_THAT(text, HasSubstr("9 datagrams dropped by the kernel"));
  EXPECT_THAT(text, HasSubstr("at least 4 from senders without a message after"));
  EXPECT_THAT(text, HasSubstr("127.0.0.1:40001       7 lost, 100 received"));
  EXPECT_THAT(text, HasSubstr("POSITION/axis1        5 lost, 90 recorded"));
  const auto json = nlohmann::json::parse(RecordEndJson("events", status));
  EXPECT_EQ(json["lost"], 7);
  EXPECT_EQ(json["kernel_dropped"], 9);
  EXPECT_EQ(json["senders"][0]["lost"], 7);
  EXPECT_FALSE(json["whole"]);
}

TEST(RecordReport, ADiskThatKeptNothingIsAFailure) {
  RecordingStatus status;
  status.unwritten = 3;
  status.disk.last_error = "a.lcm: No space left on device";
  EXPECT_EQ(RecordExitCode(status), kExitFailed);
  EXPECT_THAT(RecordSummary(status), HasSubstr("No space left"));
  RecordingStatus damaged;
  damaged.disk.damaged = true;
  EXPECT_EQ(RecordExitCode(damaged), kExitFailed);
  EXPECT_FALSE(nlohmann::json::parse(RecordEndJson("events", damaged))["whole"]);
}

TEST(RecordReport, TheStatusLineTellsHowLongTheDiskLasts) {
  recorder_health_t health{};
  health.messages_hz = 19'600;
  health.bytes_hz = 1'000'000;
  health.messages = 40'000;
  health.total_bytes = 12'300'000;
  health.free_bytes = 12'000'000'000;
  EXPECT_EQ(RecordStatusLine(health, {}),
            "19600 messages/s  1.0 MB/s  40000 messages, 12.3 MB  lost 0  free 12.0 GB (3.3 h)");
  health.state = recorder_health_t::STATE_DISK_FULL;
  health.kernel_dropped = 3;
  EXPECT_THAT(RecordStatusLine(health, {}), HasSubstr("DISK FULL"));
  EXPECT_THAT(RecordStatusLine(health, {}), HasSubstr("(kernel 3)"));
  health.bytes_hz = 0;
  EXPECT_THAT(RecordStatusLine(health, {}), Not(HasSubstr("(3")));
}

TEST(RecordReport, LogsThatAreNotShippedAreShown) {
  const recorder_health_t health{};
  EXPECT_THAT(RecordStatusLine(health, {}), Not(HasSubstr("SHIPPED")));
  EXPECT_THAT(RecordStatusLine(health, {.held_logs = 1, .held_bytes = 2'000'000}),
              HasSubstr("  NOT SHIPPED 1 log, 2.0 MB"));
  EXPECT_THAT(RecordStatusLine(health, {.held_logs = 3, .held_bytes = 7, .deleted_unshipped = 2}),
              HasSubstr("  NOT SHIPPED 3 logs, 7 B  DELETED UNSHIPPED 2"));
  RecordingStatus status;
  EXPECT_THAT(RecordSummary(status), Not(HasSubstr("nearly full")));
  status.disk.closed.deleted_unshipped = 2;
  EXPECT_THAT(RecordSummary(status),
              HasSubstr("the disk was nearly full: 2 logs were deleted before they were shipped"));
}

}  // namespace
}  // namespace axlecast
