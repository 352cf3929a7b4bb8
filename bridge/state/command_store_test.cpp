#include "bridge/state/command_store.h"

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

command_status_t Status(std::uint32_t number, bool ended) {
  command_status_t status{};
  const CommandId id = NumberedId(number);
  std::copy(id.begin(), id.end(), std::begin(status.id));
  status.state = ended ? command_status_t::STATE_SUCCEEDED : command_status_t::STATE_RUNNING;
  status.is_final = ended ? 1 : 0;
  return status;
}

int Kept(const CommandStore& memory, std::uint32_t count) {
  int kept = 0;
  for (std::uint32_t i = 0; i < count; ++i) kept += memory.Find(NumberedId(i)) != nullptr ? 1 : 0;
  return kept;
}

TEST(CommandStore, EndedCommandsWhoseValidityIsOverMakeRoom) {
  constexpr std::uint32_t kCommands = 30'000;
  CommandStore memory;
  for (std::uint32_t i = 0; i < kCommands; ++i) {
    ASSERT_FALSE(memory.IsFull(kSecond)) << i;
    memory.Begin(Status(i, true), 0);
    memory.Update(Status(i, true));
  }
  EXPECT_LE(Kept(memory, kCommands), static_cast<std::uint32_t>(CommandStore::kMinKept) + 1);
  EXPECT_NE(memory.Find(NumberedId(kCommands - 1)), nullptr);
}

TEST(CommandStore, IsFullOfCommandsThatMayNotBeForgotten) {
  CommandStore memory;
  std::uint32_t begun = 0;
  for (; begun < 50'000 && !memory.IsFull(kSecond); ++begun)
    memory.Begin(Status(begun, begun % 2 == 0), 2 * kSecond);
  EXPECT_EQ(begun, static_cast<std::uint32_t>(CommandStore::kMaxKept));
  EXPECT_EQ(Kept(memory, begun), begun) << "running, or valid still";
}

}  // namespace

}  // namespace axlecast
