#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "core/device/family.h"

// The declarations of every family about its operations are consistent: the journal, the roles, the permits and the wear rely on it.
namespace axlecast {
namespace {

template <typename Check>
void ForEachOperation(Check check) {
  for (const Family* family : Families()) {
    for (const OperationSpec& operation : family->operations) {
      SCOPED_TRACE(std::string(family->name) + ' ' + std::string(operation.name));
      check(*family, operation);
    }
  }
}

TEST(FamilyOperations, AreNamedOnceAndExplained) {
  for (const Family* family : Families()) {
    std::set<std::string_view> names;
    for (const OperationSpec& operation : family->operations) {
      EXPECT_TRUE(names.insert(operation.name).second) << operation.name;
    }
  }
  ForEachOperation([](const Family&, const OperationSpec& operation) {
    EXPECT_FALSE(operation.help.empty());
    EXPECT_FALSE(operation.verification.empty());
  });
}

TEST(FamilyOperations, ThatReadChangeNothing) {
  ForEachOperation([](const Family&, const OperationSpec& operation) {
    if (!operation.reads_only) return;
    EXPECT_FALSE(operation.destructive);
    EXPECT_FALSE(operation.moves_datum);
    EXPECT_FALSE(operation.needs_standstill);
    EXPECT_FALSE(operation.needs_permit);
    EXPECT_FALSE(operation.urgent);
    EXPECT_EQ(operation.writes, nullptr);
    EXPECT_TRUE(operation.verified_by_operation.empty());
  });
}

TEST(FamilyOperations, ThatAreNamedAsReadingsRead) {
  ForEachOperation([](const Family&, const OperationSpec& operation) {
    for (const char* verb : {"read", "check", "query", "fetch", "eeprom_read", "eeprom_backup"}) {
      if (operation.name.starts_with(verb)) {
        EXPECT_TRUE(operation.reads_only);
      }
    }
    for (const char* verb :
         {"clear", "set", "write", "zero", "reset", "save", "start", "stop", "log", "eeprom_write"}) {
      if (operation.name.starts_with(verb)) {
        EXPECT_FALSE(operation.reads_only);
      }
    }
  });
}

// A servo that holds its position would run away when its feedback jumps.
TEST(FamilyOperations, ThatMoveTheDatumNeedARestingShaftAndAPermit) {
  ForEachOperation([](const Family& family, const OperationSpec& operation) {
    if (!operation.moves_datum) return;
    EXPECT_TRUE(family.has_position);
    EXPECT_TRUE(operation.destructive);
    EXPECT_TRUE(operation.needs_standstill);
    EXPECT_TRUE(operation.needs_permit);
    EXPECT_FALSE(operation.verified_by_operation.empty());
  });
}

TEST(FamilyOperations, NeedARestingShaftForNothingElse) {
  ForEachOperation([](const Family&, const OperationSpec& operation) {
    if (operation.needs_standstill) {
      EXPECT_TRUE(operation.moves_datum);
    }
  });
}

TEST(FamilyOperations, ThatWearTheMemoryAreDestructiveAndCountTheirWrites) {
  ForEachOperation([](const Family&, const OperationSpec& operation) {
    if (operation.writes == nullptr) return;
    EXPECT_TRUE(operation.destructive);
    EXPECT_GE(operation.writes({}), 0);
    EXPECT_EQ(operation.writes({{"data", "?"}, {"address", "?"}, {"name", "?"}}), operation.writes({}));
  });
}

TEST(FamilyOperations, AreFoundByOnesThatReadAndTakeAfter) {
  ForEachOperation([](const Family& family, const OperationSpec& operation) {
    if (operation.verified_by_operation.empty()) return;
    const auto found =
        std::find_if(family.operations.begin(), family.operations.end(),
                     [&](const OperationSpec& other) { return other.name == operation.verified_by_operation; });
    ASSERT_NE(found, family.operations.end());
    EXPECT_TRUE(found->reads_only);
    EXPECT_TRUE(std::any_of(found->arguments.begin(), found->arguments.end(), [](const ArgumentSpec& argument) {
      return argument.name == "after" && !argument.required;
    }));
  });
}

}  // namespace
}  // namespace axlecast
