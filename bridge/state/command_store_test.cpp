#include "bridge/state/command_store.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

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
  EXPECT_EQ(memory.Find(NumberedId(9'899)), nullptr);
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

TEST(CommandStore, ACommandThatBeginsAgainTakesNoSecondPlace) {
  CommandStore memory;
  memory.Begin(Status(0, false), 0);
  memory.Begin(Status(0, true), 0);
  ASSERT_NE(memory.Find(NumberedId(0)), nullptr);
  EXPECT_EQ(memory.Find(NumberedId(0))->latest.is_final, 1);
  for (std::uint32_t i = 1; i < CommandStore::kMinKept; ++i) memory.Begin(Status(i, true), 0);
  ASSERT_TRUE(memory.MakeRoom(kSecond));
  EXPECT_NE(memory.Find(NumberedId(0)), nullptr);
}

TEST(CommandStore, AForgottenCommandAndOneThatEndsLateMakeRoomToo) {
  CommandStore memory;
  memory.Begin(Status(0, false), 0);  // runs for long
  memory.Begin(Status(1, false), 0);
  memory.Forget(NumberedId(1));
  const auto pass = [&memory](std::uint32_t from, std::uint32_t until) {
    for (std::uint32_t i = from; i < until; ++i) {
      memory.Begin(Status(i, true), 0);
      ASSERT_TRUE(memory.MakeRoom(kSecond)) << i;
    }
  };
  pass(2, 10'000);
  EXPECT_NE(memory.Find(NumberedId(0)), nullptr);
  memory.Update(Status(0, true));
  pass(10'000, 20'000);
  EXPECT_EQ(memory.Find(NumberedId(0)), nullptr);
}

TEST(CommandStore, EndedCommandsWhoseValidityIsOverMakeRoom) {
  constexpr std::uint32_t kCommands = 30'000;
  CommandStore memory;
  for (std::uint32_t i = 0; i < kCommands; ++i) {
    ASSERT_TRUE(memory.MakeRoom(kSecond)) << i;
    memory.Begin(Status(i, true), 0);
    memory.Update(Status(i, true));
  }
  EXPECT_LE(Kept(memory, kCommands), static_cast<std::uint32_t>(CommandStore::kMinKept) + 1);
  EXPECT_NE(memory.Find(NumberedId(kCommands - 1)), nullptr);
}

TEST(CommandStore, IsFullOfCommandsThatMayNotBeForgotten) {
  CommandStore memory;
  std::uint32_t begun = 0;
  for (; begun < 50'000 && memory.MakeRoom(kSecond); ++begun)
    memory.Begin(Status(begun, begun % 2 == 0), 2 * kSecond);
  EXPECT_EQ(begun, static_cast<std::uint32_t>(CommandStore::kMaxKept));
  EXPECT_EQ(Kept(memory, begun), begun) << "running, or valid still";
}

TEST(CommandStore, ACommandIsPublishedOnceItsAcceptanceIsOnDisk) {
  CommandStore memory;
  command_status_t status = Status(1, false);
  memory.Begin(status, 5 * kSecond);
  const KnownCommand* known = memory.Find(NumberedId(1));
  ASSERT_NE(known, nullptr);
  EXPECT_EQ(known->latest.state, command_status_t::STATE_RUNNING);
  EXPECT_EQ(known->published.state, command_status_t::STATE_UNKNOWN);
  EXPECT_EQ(known->begin_by, 5 * kSecond);
  memory.MarkPublished(status);
  EXPECT_EQ(known->published.state, command_status_t::STATE_RUNNING);
  status.state = command_status_t::STATE_SUCCEEDED;
  memory.Update(status);
  EXPECT_EQ(known->latest.state, command_status_t::STATE_SUCCEEDED);
  EXPECT_EQ(known->published.state, command_status_t::STATE_RUNNING);
  EXPECT_FALSE(memory.IsVolatile(NumberedId(1)));
  memory.Forget(NumberedId(1));
  EXPECT_EQ(memory.Find(NumberedId(1)), nullptr);
}

TEST(CommandStore, AReadIsPublishedAtOnce) {
  CommandStore memory;
  command_status_t status = Status(1, false);
  memory.PutVolatile(status, kSecond);
  EXPECT_TRUE(memory.IsVolatile(NumberedId(1)));
  status.state = command_status_t::STATE_SUCCEEDED;
  memory.Update(status);
  const KnownCommand* known = memory.Find(NumberedId(1));
  ASSERT_NE(known, nullptr);
  EXPECT_EQ(known->latest.state, command_status_t::STATE_SUCCEEDED);
  EXPECT_EQ(known->published.state, command_status_t::STATE_SUCCEEDED);
}

TEST(CommandStore, NothingBeginsByBeingUpdatedOrPublished) {
  CommandStore memory;
  memory.Update(Status(1, true));
  memory.MarkPublished(Status(1, true));
  EXPECT_EQ(memory.Find(NumberedId(1)), nullptr);
}

// Fills a store with commands in `state`, and then lets it drop what it may.
int KeptOf(command_status_t status, MonoNs begin_by) {
  constexpr std::uint32_t kFew = 100;
  CommandStore memory;
  for (std::uint32_t i = 0; i < CommandStore::kMinKept + kFew; ++i) {
    const CommandId id = NumberedId(i);
    std::copy(id.begin(), id.end(), std::begin(status.id));
    memory.Begin(status, begin_by);
  }
  for (std::uint32_t i = 0; i < kFew; ++i) static_cast<void>(memory.MakeRoom(kSecond));
  return Kept(memory, CommandStore::kMinKept + kFew) - static_cast<int>(CommandStore::kMinKept);
}

TEST(CommandStore, KeepsWhatMayStillChangeOrBegin) {
  command_status_t status = Status(0, true);
  EXPECT_EQ(KeptOf(status, kSecond - 1), 0);
  EXPECT_EQ(KeptOf(status, kSecond), 100) << "it is valid still";
  status.is_final = 0;
  EXPECT_EQ(KeptOf(status, 0), 100) << "it is running";
  status.is_final = 1;
  status.state = command_status_t::STATE_INDETERMINATE;
  EXPECT_EQ(KeptOf(status, 0), 100) << "its effect is looked for";
  status.finding = command_status_t::FINDING_CANNOT_TELL;
  EXPECT_EQ(KeptOf(status, 0), 0);
}

TEST(CommandStore, LooksAtSixteenCommandsAtATime) {
  CommandStore memory;
  for (std::uint32_t i = 0; i < CommandStore::kMinKept + 100; ++i) memory.Begin(Status(i, true), 0);
  static_cast<void>(memory.MakeRoom(kSecond));
  EXPECT_EQ(Kept(memory, CommandStore::kMinKept + 100), static_cast<int>(CommandStore::kMinKept) + 100 - 16);
  EXPECT_EQ(memory.Find(NumberedId(15)), nullptr) << "the oldest go first";
}

TEST(CommandStore, AForgottenCommandTakesNoPlace) {
  CommandStore memory;
  for (std::uint32_t i = 0; i < CommandStore::kMinKept + 10; ++i) memory.Begin(Status(i, true), 0);
  for (std::uint32_t i = 0; i < 10; ++i) memory.Forget(NumberedId(i));
  static_cast<void>(memory.MakeRoom(kSecond));
  EXPECT_EQ(Kept(memory, CommandStore::kMinKept + 10), static_cast<int>(CommandStore::kMinKept))
      << "the others have ended, and have room";
}

std::int32_t WritesOfPages(const Arguments& arguments) {
  std::int32_t writes = 0;
  for (const auto& [key, value] : arguments) writes += key == "page" ? std::stoi(value) : 0;
  return writes;
}

TEST(PendingCommand, ItsArgumentsDecideItsWrites) {
  PendingCommand pending;
  EXPECT_EQ(pending.WritesAtMost(), 0);
  OperationSpec operation = {.name = "write", .help = "writes pages"};
  pending.operation = &operation;
  EXPECT_EQ(pending.WritesAtMost(), 0) << "its memory is not limited";
  operation.writes = &WritesOfPages;
  pending.arguments = {{"page", "3"}, {"note", "9"}, {"page", "4"}};
  EXPECT_EQ(pending.WritesAtMost(), 7);
}

TEST(PendingCommand, ArgumentsAndChangesAreFoundByTheirKeys) {
  PendingCommand pending;
  pending.arguments = {{"a", "1"}, {"b", "2"}};
  EXPECT_EQ(ArgumentOf(pending, "a"), "1");
  EXPECT_EQ(ArgumentOf(pending, "b"), "2");
  EXPECT_EQ(ArgumentOf(pending, "c"), "");
  command_status_t status{};
  status.changes = {{"a", "1", "2"}, {"b", "3", "4"}};
  EXPECT_EQ(ChangedTo(status, "a"), "2");
  EXPECT_EQ(ChangedTo(status, "b"), "4");
  EXPECT_EQ(ChangedTo(status, "c"), "");
}

}  // namespace

}  // namespace axlecast
