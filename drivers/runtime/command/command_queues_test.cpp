#include <gtest/gtest.h>

#include "drivers/runtime/command/driver_command_server.h"
#include "tests/support/counting_family.h"

namespace axlecast {
namespace {

class CommandQueuesTest : public testing::Test {
 protected:
  void Push(const std::string& device, bool urgent = false) {
    queues_.Push(*queues_.Find(device, urgent), NumberedId(++number_));
  }
  CommandQueues::Queue* Next() {
    return queues_.Next([](const CommandId&) { return false; });
  }
  // The device of the next command, which is finished at once; nothing: no command waits.
  std::string Done() {
    CommandQueues::Queue* queue = Next();
    if (queue == nullptr) return "";
    queues_.Hold(*queue);
    queue->held.reset();
    return queue->device;
  }

  std::uint32_t number_ = 0;
  CommandQueues queues_{CountingBus("b0", {"axis1", "axis2", "axis3"})};
};

TEST_F(CommandQueuesTest, TheDevicesAreServedRoundRobin) {
  for (const char* device : {"axis1", "axis2", "axis3"}) {
    Push(device);
    Push(device);
  }
  for (const char* device : {"axis1", "axis2", "axis3", "axis1", "axis2", "axis3", ""}) EXPECT_EQ(Done(), device);
}

TEST_F(CommandQueuesTest, ADeviceWithoutACommandIsSkipped) {
  Push("axis1");
  EXPECT_EQ(Done(), "axis1");
  Push("axis1");
  Push("axis3");
  EXPECT_EQ(Done(), "axis3");
  EXPECT_EQ(Done(), "axis1");
}

TEST_F(CommandQueuesTest, AnUrgentCommandOfAnyDeviceIsFirst) {
  Push("axis1");
  Push("axis3", true);
  EXPECT_EQ(Done(), "axis3");
  EXPECT_EQ(Done(), "axis1");
}

TEST_F(CommandQueuesTest, NothingWaitsOnceTheCommandsWereDroppedOrHeld) {
  EXPECT_FALSE(queues_.any_waiting());
  Push("axis1");
  EXPECT_TRUE(queues_.any_waiting());
  EXPECT_TRUE(queues_.Drop(*queues_.Find("axis1", false), NumberedId(number_)));
  EXPECT_FALSE(queues_.any_waiting());
  Push("axis2");
  EXPECT_EQ(queues_.Hold(*Next()), NumberedId(number_));
  EXPECT_FALSE(queues_.any_waiting());
}

TEST(CommandQueues, ABusWithoutDevicesHasNoCommand) {
  CommandQueues queues(CountingBus("b0", {}));
  EXPECT_EQ(queues.Next([](const CommandId&) { return false; }), nullptr);
  EXPECT_EQ(queues.Find("axis1", false), nullptr);
  EXPECT_EQ(queues.Devices(), "");
}

}  // namespace
}  // namespace axlecast
