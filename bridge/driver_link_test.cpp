#include "bridge/driver_link.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

TEST(DriverLinkTest, WhoJustBeganToListenCannotTellThatADriverIsAbsent) {
  DriverLink link;
  link.ListenFrom(100 * kSecond);
  EXPECT_FALSE(link.IsPresent(100 * kSecond));
  EXPECT_FALSE(link.IsAbsent(100 * kSecond + DriverLink::kAbsentAfter));
  EXPECT_TRUE(link.IsAbsent(100 * kSecond + DriverLink::kAbsentAfter + 1));
}

TEST(DriverLinkTest, AGoodbyeIsAbsenceAtOnce) {
  DriverLink link;
  link.ListenFrom(0);
  driver_status_t hello{};
  hello.boot_id = 7;
  hello.kind = driver_status_t::KIND_HELLO;
  ASSERT_TRUE(link.On(hello, kSecond));
  EXPECT_TRUE(link.IsPresent(2 * kSecond));
  EXPECT_FALSE(link.IsAbsent(2 * kSecond));
  hello.kind = driver_status_t::KIND_GOODBYE;
  ASSERT_TRUE(link.On(hello, 2 * kSecond));
  EXPECT_TRUE(link.IsAbsent(2 * kSecond));
}

}  // namespace
}  // namespace axlecast
