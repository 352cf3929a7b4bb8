#include "tests/power_cuts/power_cuts.h"

#include <gtest/gtest.h>

#include <string>

namespace axlecast {
namespace {

std::string Texts(const CutTally& tally) {
  std::string all = std::to_string(tally.breaches) + " breaches in " + std::to_string(tally.states) + " states";
  for (const std::string& text : tally.texts) all += "\n" + text;
  return all;
}

TEST(PowerCutsTest, AJournalKeepsEverythingThatReturnedTrue) {
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const CutTally tally = CutJournal({.seed = seed, .operations = 12, .stride = 4, .random_states = 1});
    EXPECT_EQ(tally.breaches, 0) << Texts(tally);
    EXPECT_GT(tally.points, 50);
    EXPECT_GT(tally.second_cuts, 0);
  }
}

TEST(PowerCutsTest, ALogKeepsWhatIsOlderThanItsSyncInterval) {
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const CutTally tally = CutLogs({.seed = seed, .operations = 20, .random_states = 1});
    EXPECT_EQ(tally.breaches, 0) << Texts(tally);
    EXPECT_GT(tally.points, 10);
  }
}

TEST(PowerCutsTest, AClosedLogIsCompleteOrAHole) {
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const CutTally tally = CutOutbox({.seed = seed, .operations = 10, .random_states = 2});
    EXPECT_EQ(tally.breaches, 0) << Texts(tally);
    EXPECT_GT(tally.points, 50);
  }
}

TEST(PowerCutsTest, AFileIsTheOldOneOrTheNewOne) {
  const CutTally tally = CutNewFiles({.seed = 1, .operations = 20});
  EXPECT_EQ(tally.breaches, 0) << Texts(tally);
  EXPECT_GT(tally.points, 80);
}

// Planted faults: the check finds each of them.

TEST(PowerCutsTest, AJournalThatIsNotSyncedIsFound) {
  EXPECT_GT(CutJournal({.operations = 3, .stride = 7, .fault = PlantedFault::kNoSync}).breaches, 0);
}

TEST(PowerCutsTest, AJournalThatAcknowledgesTooEarlyIsFound) {
  EXPECT_GT(CutJournal({.operations = 3, .stride = 3, .fault = PlantedFault::kEarlyClaim}).breaches, 0);
}

TEST(PowerCutsTest, ALogThatCountsAsSyncedTooEarlyIsFound) {
  EXPECT_GT(CutLogs({.operations = 10, .fault = PlantedFault::kEarlyClaim}).breaches, 0);
}

TEST(PowerCutsTest, ALogThatIsNotSyncedIsFound) {
  EXPECT_GT(CutLogs({.operations = 10, .fault = PlantedFault::kNoFileSync}).breaches, 0);
}

TEST(PowerCutsTest, ALogWhoseNameIsNotSyncedIsFound) {
  EXPECT_GT(CutLogs({.operations = 10, .fault = PlantedFault::kNoFolderSync}).breaches, 0);
}

TEST(PowerCutsTest, ACompressedLogThatIsNotSyncedIsFound) {
  EXPECT_GT(CutOutbox({.operations = 6, .fault = PlantedFault::kNoFileSync}).breaches, 0);
}

TEST(PowerCutsTest, AHoleWhoseFolderIsNotSyncedIsFound) {
  EXPECT_GT(CutOutbox({.operations = 6, .fault = PlantedFault::kNoFolderSync}).breaches, 0);
}

TEST(PowerCutsTest, ANewFileThatIsNotSyncedIsFound) {
  EXPECT_GT(CutNewFiles({.operations = 5, .fault = PlantedFault::kNoFileSync}).breaches, 0);
}

TEST(PowerCutsTest, ANewFileWhoseFolderIsNotSyncedIsFound) {
  EXPECT_GT(CutNewFiles({.operations = 5, .fault = PlantedFault::kNoFolderSync}).breaches, 0);
}

}  // namespace
}  // namespace axlecast
