#include "bridge/state/volatile_command_cache.h"

#include <gtest/gtest.h>

#include "tests/support/counting_family.h"

namespace axlecast {
namespace {

command_status_t Status(std::uint32_t number) {
  command_status_t status{};
  const CommandId id = NumberedId(number);
  std::copy(id.begin(), id.end(), std::begin(status.id));
  return status;
}

// Where commands may be unsigned, anybody may send read-only ones without end.
TEST(VolatileCommandCache, KeepsAsManyAsItMayAndDropsTheOldest) {
  VolatileCommandCache memory(100);
  for (std::uint32_t i = 0; i < 10'000; ++i) memory.Put(Status(i), 0);
  int kept = 0;
  for (std::uint32_t i = 0; i < 10'000; ++i) kept += memory.Find(NumberedId(i)) != nullptr ? 1 : 0;
  EXPECT_EQ(kept, 100);
  EXPECT_NE(memory.Find(NumberedId(9'999)), nullptr);
  EXPECT_NE(memory.Find(NumberedId(9'900)), nullptr);
}

TEST(VolatileCommandCache, ACommandThatArrivesAgainTakesNoSecondPlace) {
  VolatileCommandCache memory(2);
  memory.Put(Status(1), 0);
  for (std::uint32_t i = 0; i < 10; ++i) memory.Put(Status(2), 0);
  EXPECT_NE(memory.Find(NumberedId(1)), nullptr);
}

}  // namespace
}  // namespace axlecast
