#include "tools/web/web_model.h"

#include <gtest/gtest.h>

#include <axlecast/position_t.hpp>
#include <axlecast/time_quality_t.hpp>
#include <memory>

#include "core/messages/message.h"
#include "tools/monitor/test_one_axis.h"

namespace axlecast {
namespace {

constexpr std::int64_t kOwnClock = 11;
constexpr std::int64_t kOtherClock = 22;
constexpr WebTimestamp kNow = {100 * kSecond, 1'795'690'781'000'000};

MachineConfig WithTimeBase() {
  MachineConfig machine = OneAxis();
  machine.time.root = "plc1";
  return machine;
}

// A claim of a host whose UNIX clock is `ahead` (us) of that of this host.
time_quality_t Claim(const std::string& host, std::int64_t clock, std::int64_t ahead) {
  time_quality_t quality{};
  quality.host = host;
  quality.root = "plc1";
  quality.clock_id = clock;
  quality.base_id = 7;
  quality.base_ns = 5'000 * kSecond;
  quality.half_width_ns = 100'000;
  quality.state = time_quality_t::STATE_SYNCHRONISED;
  quality.utime = kNow.utime + ahead;
  quality.utc_ns = quality.utime * kMicrosecond;
  quality.utc_half_width_ns = -1;
  return quality;
}

class WebModelTimes : public ::testing::Test {
 protected:
  template <typename Message>
  void On(const std::string& channel, const Message& message) {
    model_.OnMessage(channel, Encoded(message), kNow);
  }
  // Sends a reading of another host, whose UNIX time is 3 s ahead, and returns at which time the curve has it.
  std::int64_t TimeOfReading() {
    position_t position{};
    position.clock_id = kOtherClock;
    position.utime = kNow.utime + 3'000'000;
    On("POSITION/axis1", position);
    const SampleHistory* samples = model_.samples(*model_.IndexOf("axis1"));
    return samples->utime(samples->end() - 1);
  }

  MachineConfig machine_ = WithTimeBase();
  WebModel model_{machine_, "1", std::nullopt, kOwnClock};
};

TEST_F(WebModelTimes, AReadingOfAnotherHostIsDrawnAtTheTimeOfThisHost) {
  On("TIME/plc1", Claim("plc1", kOwnClock, 0));
  On("TIME/cell2", Claim("cell2", kOtherClock, 3'000'000));
  EXPECT_EQ(TimeOfReading(), kNow.utime);
}

TEST_F(WebModelTimes, WithoutAClaimItHasTheTimeOfItsHost) {
  On("TIME/plc1", Claim("plc1", kOwnClock, 0));
  EXPECT_EQ(TimeOfReading(), kNow.utime + 3'000'000);
}

}  // namespace
}  // namespace axlecast
