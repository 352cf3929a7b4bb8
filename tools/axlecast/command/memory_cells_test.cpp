#include "tools/axlecast/command/memory_cells.h"

#include <gmock/gmock.h>

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(MemoryCells, FromWhatWasRead) {
  const auto cells = CellsOf(
      std::vector<change_t>{{"eeprom_0", "", "A1 05"}, {"eeprom_20", "", "FF"}, {"finding", "", "reads_as_after"}});
  ASSERT_TRUE(cells);
  EXPECT_EQ(*cells, (MemoryCells{{0, 0xA1}, {1, 0x05}, {20, 0xFF}}));
}

TEST(MemoryCells, MalformedAnswersAreNamed) {
  for (const auto& [key, after] :
       {std::pair("eeprom_", "00"), std::pair("eeprom_1x", "00"), std::pair("eeprom_99999999999999999999", "00"),
        std::pair("eeprom_1", "0"), std::pair("eeprom_65536", "00 00"), std::pair("eeprom_1", "")}) {
    const auto cells = CellsOf(std::vector<change_t>{{key, "", after}});
    ASSERT_FALSE(cells) << key;
    EXPECT_THAT(cells.error().text, HasSubstr("malformed")) << key;
  }
  ASSERT_FALSE(CellsOf({}));
  EXPECT_EQ(CellsOf({}).error().text, "no cells were read");
}

TEST(MemoryFile, IsReadAsItWasWritten) {
  CommandResult result;
  result.status.operation = "eeprom_backup";
  result.status.device = "axis1";
  result.status.changes = {{"eeprom_0", "", "A1 05"}, {"eeprom_20", "", "FF"}};
  const auto file = ParseMemoryFile(MemoryFileText(result));
  ASSERT_TRUE(file);
  EXPECT_EQ(file->device, "axis1");
  EXPECT_EQ(file->cells, (MemoryCells{{0, 0xA1}, {1, 0x05}, {20, 0xFF}}));
}

TEST(MemoryFile, ByHand) {
  const auto file = ParseMemoryFile("eeprom_7: a1\r\n\n  # a comment\neeprom_9:0102");
  ASSERT_TRUE(file);
  EXPECT_EQ(file->device, "");
  EXPECT_EQ(file->cells, (MemoryCells{{7, 0xA1}, {9, 1}, {10, 2}}));
}

TEST(MemoryFile, MistakesHaveTheirLine) {
  EXPECT_EQ(ParseMemoryFile("# x\neeprom_0: A1\nparameters:\n").error().text,
            "line 3 is no \"eeprom_ADDRESS: BYTES\"");
  EXPECT_EQ(ParseMemoryFile("eeprom_0 A1").error().text, "line 1 is no \"eeprom_ADDRESS: BYTES\"");
  EXPECT_EQ(ParseMemoryFile("").error().text, "it holds no cells");
}

TEST(CellRuns, NeighboursThatDiffer) {
  const MemoryCells present = {{0, 1}, {1, 2}, {2, 3}, {3, 4}, {4, 5}};
  const MemoryCells target = {{0, 9}, {1, 9}, {2, 3}, {3, 9}, {4, 5}, {5, 9}};
  const std::vector<CellRun> runs = CellRuns(present, target, 20);
  ASSERT_EQ(runs.size(), 2U) << "cell 5 is not present";
  EXPECT_EQ(runs[0].address, 0U);
  EXPECT_THAT(runs[0].before, ElementsAre(1, 2));
  EXPECT_THAT(runs[0].after, ElementsAre(9, 9));
  EXPECT_EQ(runs[1].address, 3U);
  EXPECT_EQ(CellRuns(present, target, 1).size(), 3U);
  EXPECT_TRUE(CellRuns(present, present, 20).empty());
}

}  // namespace
}  // namespace axlecast
