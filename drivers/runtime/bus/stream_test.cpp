// A device that sends by itself: Listen, ReceiveBuffer and PeriodMonitor together, through the bus.
#include <gmock/gmock.h>

#include <memory>
#include <vector>

#include "drivers/kit/stream.h"
#include "drivers/runtime/bus/bus.h"
#include "tests/support/recording_output.h"
#include "tests/support/scripted_link.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;

constexpr MonoNs kStart = 1'000 * kSecond;
constexpr MonoNs kPeriod = 10 * kMillisecond;

// Frames of three bytes, FF, counts, and their sum, once each 10 ms.
class StreamingDevice final : public Device {
 public:
  explicit StreamingDevice(DeviceOutput& output) : output_(output) {}

  [[nodiscard]] Step Next(const BusSlot&) const override {
    return {.action = Listen{cadence_.due()}, .priority = Priority::kLive};
  }
  void OnStarted(const Step&, MonoNs) override {}
  void On(const Event& event) override {
    switch (event.kind) {
      case Event::Kind::kLinkUp:
        inbox_.Clear();
        cadence_.Arrived(event.received.last);
        break;
      case Event::Kind::kUnsolicited:
        inbox_.Append(event.bytes, event.received);
        Parse();
        break;
      default:
        break;
    }
    if (cadence_.FellSilent(event.received.last)) output_.OnError(ErrorKind::kSilent, event.received);
  }
  [[nodiscard]] Result<> Validate(const DriverCommand&, MonoNs) const override { return {}; }
  void Begin(const DriverCommand&, MonoNs) override {}
  [[nodiscard]] bool Cancel(const CommandId&, MonoNs) override { return true; }

 private:
  void Parse() {
    while (inbox_.bytes().size() >= 3) {
      const Bytes bytes = inbox_.bytes();
      if (bytes[0] != 0xFF || bytes[2] != static_cast<std::uint8_t>(bytes[0] + bytes[1])) {
        inbox_.Drop(1);
        continue;
      }
      const Interval at = {inbox_.ArrivalOf(0).first, inbox_.ArrivalOf(2).last};
      output_.OnSample({.at = at, .counts = bytes[1]});
      cadence_.Arrived(at.last);
      inbox_.Drop(3);
    }
  }

  DeviceOutput& output_;
  ReceiveBuffer inbox_;
  PeriodMonitor cadence_{kPeriod, 3};
};

class Nobody final : public LinkObserver {
 public:
  void OnLink(bool, std::string_view, MonoNs) override {}
};

class StreamTest : public ::testing::Test {
 protected:
  StreamTest() {
    bus_.Add(device_);
    bus_.RunOnce(kStart);
  }
  void Send(MonoNs at, std::vector<std::uint8_t> bytes) { link_.ArriveAt(kStart + at, std::move(bytes)); }
  void RunUntil(MonoNs until) {
    while (clock_.Now() < kStart + until) bus_.RunOnce(kStart + until);
  }
  [[nodiscard]] std::vector<std::int64_t> Counts() const {
    std::vector<std::int64_t> counts;
    for (const Sample& sample : output_.samples) counts.push_back(sample.counts);
    return counts;
  }

  FakeClock clock_{kStart};
  ScriptedLink link_{clock_};
  Nobody observer_;
  RecordingOutput output_;
  StreamingDevice device_{output_};
  Bus bus_{{}, link_, clock_, observer_, nullptr};
};

TEST_F(StreamTest, FramesArriveWithTheirInstants) {
  Send(10 * kMillisecond, {0xFF, 1});
  Send(11 * kMillisecond, {0x00});
  Send(20 * kMillisecond, {0xFF, 2, 0x01});
  RunUntil(30 * kMillisecond);
  EXPECT_THAT(Counts(), ElementsAre(1, 2));
  EXPECT_EQ(output_.samples[0].at, (Interval{kStart + 10 * kMillisecond, kStart + 11 * kMillisecond}));
  EXPECT_EQ(output_.samples[1].at.first, kStart + 20 * kMillisecond);
  EXPECT_TRUE(link_.written().empty());
}

TEST_F(StreamTest, AGoodFrameAfterABadByteIsNotLost) {
  Send(10 * kMillisecond, {0xFF, 0x77, 0xFF, 3, 0x02});
  RunUntil(20 * kMillisecond);
  EXPECT_THAT(Counts(), ElementsAre(3));
}

TEST_F(StreamTest, SilenceIsReportedOnceAndInTime) {
  Send(10 * kMillisecond, {0xFF, 1, 0x00});
  RunUntil(kSecond);
  ASSERT_EQ(output_.errors.size(), 1U);
  EXPECT_EQ(output_.errors[0].first, ErrorKind::kSilent);
  EXPECT_EQ(output_.errors[0].second.last, kStart + 40 * kMillisecond);
  EXPECT_LT(link_.waits(), 10);
  link_.ArriveAt(kStart + 2 * kSecond, {0xFF, 2, 0x01});
  RunUntil(3 * kSecond);
  EXPECT_THAT(Counts(), ElementsAre(1, 2));
  EXPECT_EQ(output_.errors.size(), 2U);
}

}  // namespace
}  // namespace axlecast
