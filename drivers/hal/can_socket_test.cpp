#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <array>

#include "drivers/hal/can_socket.h"
#include "platform/os/descriptor.h"
#include "platform/os/system_clock.h"
#include "tests/support/fake_clock.h"

namespace axlecast {
namespace {

constexpr MonoNs kStart = 1'000 * kSecond;

class CanArrivalTest : public ::testing::Test {
 protected:
  CanArrivalTest() { arrival_.Start(); }

  // The present CLOCK_REALTIME; ns.
  [[nodiscard]] std::int64_t Unix() const {
    return clock_.UtcMicroseconds() * kMicrosecond + clock_.Now() % kMicrosecond;
  }

  FakeClock clock_{kStart};
  CanArrival arrival_{clock_};
};

TEST_F(CanArrivalTest, TheStampIsFoundWithinAMicrosecond) {
  clock_.Advance(10 * kMillisecond + 123);
  const MonoNs truth = clock_.Now();
  const std::int64_t stamp = Unix();
  clock_.Advance(300 * kMicrosecond);
  const Interval at = arrival_.At(stamp);
  EXPECT_LE(at.first, truth);
  EXPECT_GE(at.last, truth);
  EXPECT_LE(at.last - at.first, kMicrosecond);
}

TEST_F(CanArrivalTest, ABatchKeepsItsOwnInstants) {
  std::int64_t stamps[3];
  MonoNs truths[3];
  for (int i = 0; i < 3; ++i) {
    clock_.Advance(500 * kMicrosecond);
    stamps[i] = Unix();
    truths[i] = clock_.Now();
  }
  clock_.Advance(20 * kMillisecond);
  for (int i = 0; i < 3; ++i) {
    const Interval at = arrival_.At(stamps[i]);
    EXPECT_LE(at.first, truths[i]);
    EXPECT_GE(at.last, truths[i]);
    EXPECT_LE(at.last - at.first, kMicrosecond);
  }
}

TEST_F(CanArrivalTest, WithoutAStampItCameSinceTheQueueWasEmpty) {
  clock_.Advance(kMillisecond);
  arrival_.Empty();
  clock_.Advance(2 * kMillisecond);
  EXPECT_EQ(arrival_.At(std::nullopt), (Interval{kStart + kMillisecond, kStart + 3 * kMillisecond}));
}

// A step between the stamp and the receive: forward, the frame seems to have come long ago; back, in the future.
TEST_F(CanArrivalTest, AStepOfUnixTimeNeverShowsInTheInstant) {
  for (const std::int64_t step_us : {std::int64_t{-3'600'000'000}, std::int64_t{-40}, std::int64_t{40},
                                     std::int64_t{500'000}, std::int64_t{3'600'000'000}}) {
    arrival_.Empty();
    const MonoNs empty = clock_.Now();
    clock_.Advance(5 * kMillisecond);
    const MonoNs truth = clock_.Now();
    const std::int64_t stamp = Unix();
    clock_.Advance(kMillisecond);
    clock_.StepUtc(step_us);
    const Interval at = arrival_.At(stamp);
    EXPECT_LE(at.first, truth) << step_us;
    EXPECT_GE(at.first, empty - kMicrosecond) << step_us;
    EXPECT_GE(at.last, truth) << step_us;
    EXPECT_LE(at.last, clock_.Now()) << step_us;
    // The next frame is exact again.
    clock_.Advance(kMillisecond);
    const Interval next = arrival_.At(Unix());
    EXPECT_LE(next.last - next.first, kMicrosecond) << step_us;
  }
}

TEST_F(CanArrivalTest, NeverBeforeItsForerunnerNorAfterNow) {
  clock_.Advance(kMillisecond);
  const Interval first = arrival_.At(Unix());
  clock_.Advance(kMillisecond);
  const Interval garbled = arrival_.At(Unix() - 500 * kMillisecond);
  EXPECT_GE(garbled.first, first.first);
  EXPECT_LE(garbled.last, clock_.Now());
  const Interval ahead = arrival_.At(Unix() + kSecond);
  EXPECT_GE(ahead.first, first.first);
  EXPECT_LE(ahead.last, clock_.Now());
}

}  // namespace

// The numbers are those of linux/can/error.h (kernel 6.1), written out here.

namespace {

CanFrame ErrorFrame(std::uint32_t classes, std::array<std::uint8_t, 8> data = {}) {
  CanFrame frame{.id = kCanError | classes, .data = {}};
  frame.data.Append(data);
  return frame;
}

CanController Counted(const CanFrame& frame) {
  CanController controller;
  CountCanError(frame, controller);
  return controller;
}

TEST(CanErrorTest, BusOffAndRestart) {
  const CanController off = Counted(ErrorFrame(0x40));
  EXPECT_EQ(off.bus_offs, 1);
  EXPECT_EQ(off.restarts, 0);
  EXPECT_EQ(off.bus_errors, 0);
  EXPECT_EQ(Counted(ErrorFrame(0x100)).restarts, 1);
}

// sja1000_err: CAN_ERR_PROT | CAN_ERR_BUSERROR, its type in data[2], where in data[3].
TEST(CanErrorTest, ErrorsOfTheProtocol) {
  for (const std::uint8_t type : std::array<std::uint8_t, 5>{0x01, 0x02, 0x04, 0x08, 0x10}) {
    const CanController controller = Counted(ErrorFrame(0x88, {0, 0, type, 0x0A}));
    EXPECT_EQ(controller.bus_errors, 1) << int{type};
    EXPECT_EQ(controller.unacknowledged, 0) << int{type};
  }
  EXPECT_EQ(Counted(ErrorFrame(0x80)).bus_errors, 1);
  // A CRC error: type unspecified, location CRC sequence.
  EXPECT_EQ(Counted(ErrorFrame(0x88, {0, 0, 0, 0x08})).bus_errors, 1);
}

TEST(CanErrorTest, AMissingAcknowledgeIsToldInThreeWays) {
  const CanFrame by_class = ErrorFrame(0x20);                  // candleLight and others
  const CanFrame by_both = ErrorFrame(0xA8, {0, 0, 0, 0x19});  // flexcan
  const CanFrame by_location =
      ErrorFrame(0x88, {0, 0, 0x80, 0x19});  // sja1000: while transmitting, in the ACK slot
  for (const CanFrame& frame : {by_class, by_both, by_location}) {
    const CanController controller = Counted(frame);
    EXPECT_EQ(controller.unacknowledged, 1) << std::hex << frame.id;
    EXPECT_EQ(controller.bus_errors, 0) << std::hex << frame.id;
  }
  // A bit error in the ACK slot does not count.
  EXPECT_EQ(Counted(ErrorFrame(0x88, {0, 0, 0x01, 0x19})).unacknowledged, 0);
  EXPECT_EQ(Counted(ErrorFrame(0x88, {0, 0, 0x01, 0x19})).bus_errors, 1);
}

TEST(CanErrorTest, OverflowsAreOfTheReceiverOrTheTransmitter) {
  const CanController rx = Counted(ErrorFrame(0x04, {0, 0x01}));
  EXPECT_EQ(rx.overruns, 1);
  EXPECT_EQ(rx.queue_full, 0);
  const CanController tx = Counted(ErrorFrame(0x04, {0, 0x02}));
  EXPECT_EQ(tx.overruns, 0);
  EXPECT_EQ(tx.queue_full, 1);
  EXPECT_EQ(Counted(ErrorFrame(0x04, {0, 0x04 | 0x08})).overruns, 0);  // warning levels
  EXPECT_EQ(Counted(ErrorFrame(0x08, {0, 0x01, 0, 0})).overruns, 0);   // data[1] is of another class
}

// slcan (slc_bump_err) marks all that its adapter reports as a bus error.
TEST(CanErrorTest, AnOverflowThatIsMarkedAsABusErrorIsNone) {
  const CanController lost = Counted(ErrorFrame(0x8C, {0, 0x01}));
  EXPECT_EQ(lost.overruns, 1);
  EXPECT_EQ(lost.bus_errors, 0);
  EXPECT_EQ(Counted(ErrorFrame(0x8C, {0, 0x01, 0x04})).bus_errors, 1);  // and a stuff error
}

TEST(CanErrorTest, CountersOnlyWhereTheFrameHoldsThem) {
  const CanController told = Counted(ErrorFrame(0x204, {0, 0x20, 0, 0, 0, 0, 136, 7}));
  EXPECT_EQ(told.tec, 136);
  EXPECT_EQ(told.rec, 7);
  const CanController silent = Counted(ErrorFrame(0x004, {0, 0x20, 0, 0, 0, 0, 136, 7}));
  EXPECT_EQ(silent.tec, -1);
  EXPECT_EQ(silent.rec, -1);
}

TEST(CanErrorTest, SeveralClassesInOneFrame) {
  const CanController controller =
      Counted(ErrorFrame(0x40 | 0x04 | 0x88 | 0x200, {0, 0x01, 0x08, 0, 0, 0, 255, 1}));
  EXPECT_EQ(controller.bus_offs, 1);
  EXPECT_EQ(controller.overruns, 1);
  EXPECT_EQ(controller.bus_errors, 1);
  EXPECT_EQ(controller.tec, 255);
}

TEST(CanErrorTest, DataFramesAndShortOnesDoNoHarm) {
  CanFrame frame{.id = 0x1FF, .data = {0xFF, 0xFF, 0xFF, 0xFF}};
  const CanController none = Counted(frame);
  EXPECT_EQ(none.bus_offs + none.restarts + none.bus_errors + none.unacknowledged + none.overruns, 0);
  frame.id = kCanError | 0x3FF;
  frame.data.Clear();
  const CanController short_one = Counted(frame);
  EXPECT_EQ(short_one.bus_offs, 1);
  EXPECT_EQ(short_one.tec, -1);
}

}  // namespace

// What a machine without CAN can show; a real interface is used in tests/vm/can_socket_test.cpp.

namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

bool KernelHasCan() {
  return Descriptor(socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, 1)).valid();  // 1: CAN_RAW
}

TEST(CanSocketTest, WithoutCanOrInterfaceItSaysWhatToDo) {
  const SystemClock clock;
  CanSocket can({.interface = "nocan0", .bitrate = 250'000, .filters = {}}, clock);
  const std::string problem = ErrorText(can.Open());
  EXPECT_THAT(problem, KernelHasCan() ? AllOf(HasSubstr("nocan0 does not exist"), HasSubstr("plug the adapter in"))
                                      : AllOf(HasSubstr("this kernel has no CAN"), HasSubstr("modprobe can-raw")));
  EXPECT_FALSE(can.IsOpen());
}

TEST(CanSocketTest, AClosedOneIsLostAndCanBeWaitedOn) {
  const SystemClock clock;
  CanSocket can({.interface = "nocan0", .filters = {}}, clock);
  FrameLink::Received received;
  EXPECT_EQ(can.Receive(received), Link::Status::kLost);
  EXPECT_EQ(can.Send({.id = 0x123, .data = {1}}), FrameLink::SendResult::kLost);
  EXPECT_EQ(can.Controller().state, CanController::State::kUnknown);
  EXPECT_EQ(can.Wait(clock.Now()), Link::Status::kTimeout);
  can.Wake();
  EXPECT_EQ(can.Wait(kNever), Link::Status::kWoken);
}

}  // namespace
}  // namespace axlecast
