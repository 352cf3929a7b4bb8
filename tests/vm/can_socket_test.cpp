// CanSocket on the kernel's CAN: two SJA1000 controllers on one bus (can0, can1) and vcan. What QEMU's bus lacks (bit
// errors, missing acknowledges) is in guest/test_can_errors.py. Lines that a message names for the operator are typed
// as they are there.

#include "drivers/hal/can_socket.h"

#include <gmock/gmock.h>

#include <atomic>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include "core/device/link.h"
#include "platform/os/system_clock.h"

namespace axlecast {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using SendResult = FrameLink::SendResult;
using State = CanController::State;
using Status = Link::Status;

constexpr std::int64_t kBitrate = 250'000;
constexpr MonoNs kLong = 5 * kSecond;

void Type(const std::string& line) { ASSERT_EQ(std::system(line.c_str()), 0) << line; }

// What a message asks the operator to type.
std::string LineOf(const std::string& message) {
  const std::string mark = "as root: ";
  const std::size_t at = message.find(mark);
  return at == std::string::npos ? "false # " + message : message.substr(at + mark.size());
}

std::vector<std::uint8_t> Copy(Bytes bytes) { return {bytes.begin(), bytes.end()}; }

class CanSocketTest : public ::testing::Test {
 protected:
  // Fresh controllers. In one process: starting one takes a tenth of a second here.
  CanSocketTest() {
    Type(
        "ip link show vcan0 >/dev/null 2>&1 || ip link add vcan0 up type vcan; ip -batch - <<.\n"
        "link set can0 down\n"
        "link set can1 down\n"
        "link set can0 up type can bitrate 250000 restart-ms 0\n"
        "link set can1 up type can bitrate 250000 restart-ms 0\n"
        "link set vcan0 up\n"
        ".\n");
  }

  [[nodiscard]] CanSettings On(const std::string& interface, CanFilters filters = {}) const {
    return {.interface = interface, .bitrate = kBitrate, .filters = std::move(filters)};
  }
  // A second one on the same interface.
  [[nodiscard]] CanSettings Beside(const std::string& interface) const {
    return {.interface = interface, .bitrate = 0, .filters = {}, .sole = false};
  }

  // The next that comes within 5 s.
  [[nodiscard]] Status Next(CanSocket& link, FrameLink::Received& received) const {
    const MonoNs deadline = clock_.Now() + kLong;
    while (true) {
      const Status status = link.Receive(received);
      if (status != Status::kTimeout || clock_.Now() >= deadline) return status;
      static_cast<void>(link.Wait(deadline));
    }
  }
  [[nodiscard]] CanFrame NextFrame(CanSocket& link) const {
    FrameLink::Received received;
    EXPECT_EQ(Next(link, received), Status::kOk);
    return received.frame;
  }
  void Sleep(MonoNs time) const {
    CanSocket nothing(Beside("none"), clock_);
    const MonoNs end = clock_.Now() + time;
    while (clock_.Now() < end) static_cast<void>(nothing.Wait(end));
  }

  SystemClock clock_;
};

TEST_F(CanSocketTest, OpensAndTellsOfItsController) {
  CanSocket can(On("can0"), clock_);
  ASSERT_EQ(ErrorText(can.Open()), "");
  const CanController controller = can.Controller();
  EXPECT_EQ(controller.state, State::kActive);
  EXPECT_EQ(controller.bitrate, kBitrate);
  EXPECT_EQ(controller.restart_ms, 0);
  EXPECT_EQ(controller.tec, 0);
  EXPECT_EQ(controller.rec, 0);
}

TEST_F(CanSocketTest, AnInterfaceThatStaysOffAfterABusOffIsWarnedOf) {
  CanSocket can(On("can0"), clock_);
  ASSERT_EQ(ErrorText(can.Open()), "");
  ASSERT_THAT(can.warnings(), Contains(HasSubstr("after a bus-off can0 stays off")));
  can.Close();
  Type(LineOf(can.warnings().front()));
  ASSERT_EQ(ErrorText(can.Open()), "");
  EXPECT_THAT(can.warnings(), IsEmpty());
  EXPECT_EQ(can.Controller().restart_ms, 100);
}

TEST_F(CanSocketTest, AWrongBitRateIsRefusedWithTheLineThatMendsIt) {
  Type("ip link set can0 down; ip link set can0 up type can bitrate 500000");
  CanSocket can(On("can0"), clock_);
  const std::string problem = ErrorText(can.Open());
  EXPECT_THAT(problem, AllOf(HasSubstr("can0 is at 500000 bit/s"),
                             HasSubstr("ip link set can0 down; ip link set can0 up type can bitrate 250000")));
  EXPECT_LE(problem.size(), 120U);  // device_info_t reason: a truncated command is useless
  EXPECT_FALSE(can.IsOpen());
  Type(LineOf(problem));
  EXPECT_EQ(ErrorText(can.Open()), "");
}

TEST_F(CanSocketTest, AnInterfaceThatIsDownIsRefusedWithTheLineThatSetsItUp) {
  Type("ip link set can0 down");
  CanSocket can(On("can0"), clock_);
  const std::string problem = ErrorText(can.Open());
  EXPECT_THAT(problem,
              HasSubstr("can0 is down; as root: ip link set can0 up type can bitrate 250000 restart-ms 100"));
  Type(LineOf(problem));
  EXPECT_EQ(ErrorText(can.Open()), "");

  Type("ip link set vcan0 down");
  CanSocket vcan(On("vcan0"), clock_);
  Type(LineOf(ErrorText(vcan.Open())));
  EXPECT_EQ(ErrorText(vcan.Open()), "");
}

TEST_F(CanSocketTest, WhatIsNoCanInterfaceIsRefused) {
  EXPECT_THAT(ErrorText(CanSocket(On("can9"), clock_).Open()),
              AllOf(HasSubstr("can9 does not exist"), HasSubstr("link.iface")));
  EXPECT_THAT(ErrorText(CanSocket(On("lo"), clock_).Open()), HasSubstr("lo is no CAN interface"));
  CanSocket vcan(On("vcan7"), clock_);
  const std::string problem = ErrorText(vcan.Open());
  EXPECT_THAT(problem, HasSubstr("ip link add vcan7 type vcan"));
  Type("(" + LineOf(problem) + ") 2>/dev/null");  // the guest has no modprobe for what is loaded already
  EXPECT_EQ(ErrorText(vcan.Open()), "");
  Type("ip link del vcan7");
}

TEST_F(CanSocketTest, LoopbackIsRefusedAndListenOnlyWarnedOf) {
  Type("ip link set can0 down; ip link set can0 up type can bitrate 250000 loopback on");
  CanSocket can(On("can0"), clock_);
  std::string problem = ErrorText(can.Open());
  EXPECT_THAT(problem, HasSubstr("receives only its own frames"));
  Type(LineOf(problem));
  ASSERT_EQ(ErrorText(can.Open()), "");
  can.Close();
  Type("ip link set can0 down; ip link set can0 up type can bitrate 250000 listen-only on");
  ASSERT_EQ(ErrorText(can.Open()), "");
  ASSERT_THAT(can.warnings(), Contains(HasSubstr("sends and acknowledges nothing")));
  can.Close();
  Type(LineOf(can.warnings().front()));
  ASSERT_EQ(ErrorText(can.Open()), "");
  EXPECT_THAT(can.warnings(), IsEmpty());
}

TEST_F(CanSocketTest, FramesOfEveryKindPassUnchanged) {
  CanSocket a(On("can0"), clock_);
  CanSocket b(On("can1"), clock_);
  ASSERT_EQ(ErrorText(a.Open()) + ErrorText(b.Open()), "");
  const std::vector<CanFrame> frames = {
      {.id = 0x000, .data = {}},
      {.id = 0x7FF, .data = {1, 2, 3, 4, 5, 6, 7, 8}},
      {.id = 0x120, .data = {0x47, 0x26}},
      {.id = kCanExtended | 0x120, .data = {0xFF}},
      {.id = kCanExtended | 0x1FFF'FFFF, .data = {0}},
      {.id = kCanRemote | 0x123, .data = {}},
  };
  for (const CanFrame& frame : frames) {
    ASSERT_EQ(a.Send(frame), SendResult::kQueued);
    FrameLink::Received received;
    ASSERT_EQ(Next(b, received), Status::kOk);
    EXPECT_EQ(received.frame.id, frame.id);
    EXPECT_EQ(Copy(received.frame.data), Copy(frame.data)) << frame.id;
    EXPECT_FALSE(received.own);
  }
}

TEST_F(CanSocketTest, OwnFramesComeBackOnceAcknowledgedWhateverTheFilters) {
  CanSocket can(On("can0", {OnlyStandard(0x120)}), clock_);
  CanSocket other(On("can1"), clock_);
  ASSERT_EQ(ErrorText(can.Open()) + ErrorText(other.Open()), "");
  for (const std::uint32_t id : {0x220U, 0x7E5U, 0x220U, kCanExtended | 0x220U}) {
    ASSERT_EQ(can.Send({.id = id, .data = {1, 2}}), SendResult::kQueued);
    EXPECT_EQ(can.Controller().pending, 1);
    FrameLink::Received received;
    ASSERT_EQ(Next(can, received), Status::kOk);
    EXPECT_TRUE(received.own);
    EXPECT_EQ(received.frame.id, id);
    EXPECT_THAT(Copy(received.frame.data), ElementsAre(1, 2));
    EXPECT_EQ(can.Controller().pending, 0);
  }
  // The same identifiers from others are still filtered.
  ASSERT_EQ(other.Send({.id = 0x220, .data = {9}}), SendResult::kQueued);
  ASSERT_EQ(other.Send({.id = 0x120, .data = {8}}), SendResult::kQueued);
  EXPECT_EQ(NextFrame(can).id, 0x120U);
}

TEST_F(CanSocketTest, FiltersTellExtendedAndRemoteFramesOfTheSameNumberApart) {
  CanSocket can(On("can0", {OnlyStandard(0x120), OnlyStandard(0x7E4)}), clock_);
  CanSocket other(On("can1"), clock_);
  ASSERT_EQ(ErrorText(can.Open()) + ErrorText(other.Open()), "");
  for (const std::uint32_t id :
       {0x121U, kCanExtended | 0x120U, kCanRemote | 0x120U, 0x7E4U, kCanExtended | 0x7E4U, 0x120U}) {
    ASSERT_EQ(other.Send({.id = id, .data = {}}), SendResult::kQueued);
  }
  EXPECT_EQ(NextFrame(can).id, 0x7E4U);
  EXPECT_EQ(NextFrame(can).id, 0x120U);
}

TEST_F(CanSocketTest, TheInstantIsThatOfTheArrivalHoweverLateItIsRead) {
  CanSocket can(On("can0"), clock_);
  CanSocket other(On("can1"), clock_);
  ASSERT_EQ(ErrorText(can.Open()) + ErrorText(other.Open()), "");
  // The kernel begins to stamp some time after it was first asked to.
  FrameLink::Received received;
  int narrow = 0;
  for (int i = 0; i < 50 && narrow < 5; ++i) {
    const MonoNs before = clock_.Now();
    ASSERT_EQ(other.Send({.id = 0x120, .data = {}}), SendResult::kQueued);
    ASSERT_EQ(can.Wait(before + kLong), Status::kOk);
    const MonoNs woken = clock_.Now();
    Sleep(50 * kMillisecond);
    ASSERT_EQ(can.Receive(received), Status::kOk);
    EXPECT_LE(received.at.first, woken);
    EXPECT_LE(received.at.last, clock_.Now());
    EXPECT_GE(received.at.last, before);
    if (received.at.last - received.at.first > kMillisecond) continue;
    ++narrow;
    EXPECT_GE(received.at.first, before);
    EXPECT_LE(received.at.last, woken);
  }
  EXPECT_EQ(narrow, 5);
}

TEST_F(CanSocketTest, InstantsOfABurstAreInOrder) {
  CanSocket can(Beside("vcan0"), clock_);
  CanSocket other(Beside("vcan0"), clock_);
  ASSERT_EQ(ErrorText(can.Open()) + ErrorText(other.Open()), "");
  const MonoNs before = clock_.Now();
  for (std::uint8_t i = 0; i < 100; ++i) ASSERT_EQ(other.Send({.id = 0x120, .data = {i}}), SendResult::kQueued);
  MonoNs last = 0;
  for (std::uint8_t i = 0; i < 100; ++i) {
    FrameLink::Received received;
    ASSERT_EQ(can.Wait(clock_.Now() + kLong), Status::kOk);
    ASSERT_EQ(can.Receive(received), Status::kOk);
    EXPECT_THAT(Copy(received.frame.data), ElementsAre(i));
    EXPECT_GE(received.at.first, last);
    EXPECT_GE(received.at.last, before);
    last = received.at.first;
  }
  EXPECT_LE(last, clock_.Now());
}

TEST_F(CanSocketTest, ASecondDriverIsKeptOffAndListenersAreNot) {
  CanSocket first(On("can0"), clock_);
  CanSocket second(On("can0"), clock_);
  CanSocket listener(Beside("can0"), clock_);
  CanSocket elsewhere(On("can1"), clock_);
  ASSERT_EQ(ErrorText(first.Open()), "");
  EXPECT_THAT(ErrorText(second.Open()), ::testing::EndsWith(kLineHeld));
  EXPECT_FALSE(second.IsOpen());
  EXPECT_EQ(ErrorText(listener.Open()), "");
  EXPECT_EQ(ErrorText(elsewhere.Open()), "");
  ASSERT_EQ(ErrorText(first.Open()), "");  // again
  first.Close();
  EXPECT_EQ(ErrorText(second.Open()), "");
}

TEST_F(CanSocketTest, AnInterfaceThatGoesDownIsLost) {
  CanSocket can(On("can0"), clock_);
  ASSERT_EQ(ErrorText(can.Open()), "");
  std::thread operator_types([] { Type("ip link set can0 down"); });
  Status status = Status::kTimeout;
  FrameLink::Received received;
  for (const MonoNs deadline = clock_.Now() + kLong; status != Status::kLost && clock_.Now() < deadline;) {
    status = can.Wait(deadline);
    if (status == Status::kOk) status = can.Receive(received);
  }
  operator_types.join();
  EXPECT_EQ(status, Status::kLost);
  EXPECT_EQ(can.Controller().state, State::kStopped);
  EXPECT_EQ(can.Send({.id = 0x120, .data = {}}), SendResult::kLost);
  Type(LineOf(ErrorText(can.Open())));
  ASSERT_EQ(ErrorText(can.Open()), "");
  EXPECT_EQ(can.Controller().state, State::kActive);
}

TEST_F(CanSocketTest, AnInterfaceThatIsPulledOutIsLost) {
  Type("ip link add vcan5 type vcan; ip link set vcan5 up");
  CanSocket can(On("vcan5"), clock_);
  ASSERT_EQ(ErrorText(can.Open()), "");
  EXPECT_EQ(can.Controller().state, State::kUnknown);
  Type("ip link del vcan5");
  FrameLink::Received received;
  EXPECT_EQ(Next(can, received), Status::kLost);
  EXPECT_EQ(can.Send({.id = 0x120, .data = {}}), SendResult::kLost);
  EXPECT_EQ(can.Controller().state, State::kUnknown);
  EXPECT_THAT(ErrorText(can.Open()), HasSubstr("vcan5 does not exist"));
}

// Error frames as a controller's driver makes them, sent through vcan.
TEST_F(CanSocketTest, ErrorFramesAreHandedOverAndCounted) {
  CanSocket can({.interface = "vcan0", .bitrate = kBitrate, .filters = {OnlyStandard(0x120)}}, clock_);
  CanSocket controller(Beside("vcan0"), clock_);
  ASSERT_EQ(ErrorText(can.Open()) + ErrorText(controller.Open()), "");
  const std::vector<CanFrame> frames = {
      {.id = kCanError | 0x40, .data = {0, 0, 0, 0, 0, 0, 0, 0}},       // bus-off
      {.id = kCanError | 0x100, .data = {0, 0, 0, 0, 0, 0, 0, 0}},      // restarted
      {.id = kCanError | 0x20, .data = {0, 0, 0, 0x19, 0, 0, 0, 0}},    // no acknowledge
      {.id = kCanError | 0x88, .data = {0, 0, 0x04, 0, 0, 0, 0, 0}},    // stuff error
      {.id = kCanError | 0x04, .data = {0, 0x01, 0, 0, 0, 0, 0, 0}},    // overrun
      {.id = kCanError | 0x204, .data = {0, 0x20, 0, 0, 0, 0, 136, 9}}  // error-passive, with counters
  };
  for (const CanFrame& frame : frames) {
    ASSERT_EQ(controller.Send(frame), SendResult::kQueued);
    EXPECT_EQ(NextFrame(can).id, frame.id);
  }
  const CanController told = can.Controller();
  EXPECT_EQ(told.bus_offs, 1);
  EXPECT_EQ(told.restarts, 1);
  EXPECT_EQ(told.unacknowledged, 1);
  EXPECT_EQ(told.bus_errors, 1);
  EXPECT_EQ(told.overruns, 1);
  EXPECT_EQ(told.tec, 136);
  EXPECT_EQ(told.rec, 9);
  EXPECT_EQ(can.Errors().framing, 1);
  EXPECT_EQ(can.Errors().dropped, 1);
}

TEST_F(CanSocketTest, WhatDoesNotFitIsCountedToTheFrame) {
  CanSocket can(On("vcan0"), clock_);
  CanSocket other(Beside("vcan0"), clock_);
  ASSERT_EQ(ErrorText(can.Open()) + ErrorText(other.Open()), "");
  constexpr std::int64_t kSent = 20'000;  // more than a second of a full bus at 250 kbit/s
  FrameLink::Received received;
  // Each frame is waited for until it is back: what overflows the kernel's queue of received frames (1000,
  // net.core.netdev_max_backlog), while its thread waits for the processor, reaches no socket and is in no socket's count.
  for (std::int64_t sent = 0; sent < kSent; sent += 100) {
    for (int i = 0; i < 100; ++i) ASSERT_EQ(other.Send({.id = 0x120, .data = {}}), SendResult::kQueued);
    for (int i = 0; i < 100; ++i) ASSERT_EQ(Next(other, received), Status::kOk);
  }
  std::int64_t heard = 0;
  while (can.Receive(received) == Status::kOk) ++heard;
  EXPECT_GE(heard, kBitrate / 47);  // room for one second of the shortest frames
  EXPECT_LT(heard, kSent);
  // The kernel reports the count with the next frame that it has room for.
  ASSERT_EQ(other.Send({.id = 0x121, .data = {}}), SendResult::kQueued);
  EXPECT_EQ(NextFrame(can).id, 0x121U);
  EXPECT_EQ(can.Controller().dropped, kSent - heard);
  EXPECT_EQ(can.Errors().dropped, kSent - heard);
}

TEST_F(CanSocketTest, CandumpHearsWhatADriverSends) {
  CanSocket can(On("can0"), clock_);
  ASSERT_EQ(ErrorText(can.Open()), "");
  std::atomic<bool> heard = false;
  std::thread candump([&] {
    EXPECT_EQ(std::system("timeout 20 candump -L -n 1 can0,220:7FF | grep -q ' 220#0120'"), 0);
    heard = true;
  });
  while (!heard) {
    EXPECT_EQ(can.Send({.id = 0x220, .data = {0x01, 0x20}}), SendResult::kQueued);
    Sleep(20 * kMillisecond);
  }
  candump.join();
}

}  // namespace
}  // namespace axlecast
