// What a machine without CAN can show; a real interface is used in tests/vm/can_socket_test.cpp.

#include "drivers/hal/can_socket.h"

#include <gmock/gmock.h>
#include <sys/socket.h>

#include "platform/os/descriptor.h"
#include "platform/os/system_clock.h"

namespace axlecast {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

bool KernelHasCan() {
  return Descriptor(socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, 1)).valid();  // 1: CAN_RAW
}

TEST(CanSocketTest, WithoutCanOrInterfaceItSaysWhatToDo) {
  const SystemClock clock;
  CanSocket can({.interface = "nocan0", .bitrate = 250'000, .filters = {}}, clock);
  const std::string problem = can.Open();
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
