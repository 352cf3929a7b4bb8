// The numbers are those of linux/can/error.h (kernel 6.1), written out here.

#include "drivers/hal/can_socket.h"

#include <gtest/gtest.h>

#include <array>

namespace axlecast {
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
  // A bit error in the ACK slot is none.
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
}  // namespace axlecast
