#include "core/messages/origin.h"

#include <gtest/gtest.h>

#include <axlecast/position_t.hpp>

namespace axlecast {
namespace {

// draft-eastlake-fnv-17, appendix C: test vectors of 64-bit FNV-1a.
TEST(NameHash, IsFnv1a) {
  EXPECT_EQ(static_cast<std::uint64_t>(NameHash("")), 0xCBF29CE484222325U);
  EXPECT_EQ(static_cast<std::uint64_t>(NameHash("a")), 0xAF63DC4C8601EC8CU);
  EXPECT_EQ(static_cast<std::uint64_t>(NameHash("foobar")), 0x85944171F73967E8U);
}

TEST(Origin, SetsTheFieldsOfAMessage) {
  position_t message{};
  Origin{.boot_id = 1, .machine_id = 2, .clock_id = 3}.Set(message);
  EXPECT_EQ(message.boot_id, 1);
  EXPECT_EQ(message.machine_id, 2);
  EXPECT_EQ(message.clock_id, 3);
}

}  // namespace
}  // namespace axlecast
