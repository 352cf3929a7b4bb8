#include "tools/fleet/ship/ship_state.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/support/temporary_folder.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(Installation, IsReadBackEqual) {
  const Installation installation{.id = NewInstallationId(), .names = {"press3", "press4"}};
  EXPECT_EQ(ParseInstallation(FormatInstallation(installation)).value(), installation);
  EXPECT_NE(NewInstallationId(), installation.id);
  for (const char* text : {"", "{", "[]", "{}", R"({"installation":"x","names":[]})",
                           R"({"installation":"0f0e0d0c-0b0a-4908-8706-050403020100","names":[1]})",
                           R"({"installation":"0f0e0d0c-0b0a-4908-8706-050403020100"})"}) {
    EXPECT_FALSE(ParseInstallation(text)) << text;
  }
}

class ShipStateTest : public ::testing::Test {
 protected:
  TemporaryFolder folder_;
};

TEST_F(ShipStateTest, StaysTheSame) {
  std::string id;
  {
    ShipState state;
    ASSERT_EQ(ErrorText(state.Open(folder_.path() + "/a/b")), "");
    id = state.installation().id;
    EXPECT_THAT(state.installation().names, IsEmpty());
    EXPECT_TRUE(state.AddName("press3"));
    EXPECT_TRUE(state.AddName("press3"));
  }
  ShipState state;
  ASSERT_TRUE(state.Open(folder_.path() + "/a/b"));
  EXPECT_EQ(state.installation().id, id);
  EXPECT_THAT(state.installation().names, ElementsAre("press3"));
}

TEST_F(ShipStateTest, RefusesASecondShipper) {
  ShipState first;
  ASSERT_TRUE(first.Open(folder_.path()));
  ShipState second;
  EXPECT_THAT(ErrorText(second.Open(folder_.path())), HasSubstr("another `axlecast ship`"));
}

TEST_F(ShipStateTest, DoesNotReplaceADamagedFile) {
  std::ofstream(folder_.path() + "/installation.json") << "{";
  ShipState state;
  EXPECT_THAT(ErrorText(state.Open(folder_.path())), HasSubstr("fleet adopt"));
}

}  // namespace
}  // namespace axlecast
