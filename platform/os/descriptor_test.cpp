#include "platform/os/descriptor.h"

#include <gtest/gtest.h>
#include <poll.h>

#include <thread>

namespace axlecast {
namespace {

bool IsReadable(const WakeEvent& event) {
  pollfd readable{event.FileDescriptor(), POLLIN, 0};
  return poll(&readable, 1, 0) == 1;
}

TEST(WakeEvent, IsReadableFromSetToTake) {
  const WakeEvent event;
  ASSERT_TRUE(event.valid());
  EXPECT_FALSE(IsReadable(event));
  EXPECT_FALSE(event.Take());
  event.Set();
  event.Set();
  EXPECT_TRUE(IsReadable(event));
  EXPECT_TRUE(event.Take());
  EXPECT_FALSE(IsReadable(event));
  EXPECT_FALSE(event.Take()) << "two calls of Set are one";
}

TEST(WakeEvent, EndsTheWaitOfAnotherThread) {
  const WakeEvent event;
  std::thread other([&event] { event.Set(); });
  pollfd readable{event.FileDescriptor(), POLLIN, 0};
  EXPECT_EQ(poll(&readable, 1, -1), 1);
  other.join();
}

}  // namespace

}  // namespace axlecast
