#include "tools/axlecast/logs/replay_keys.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace axlecast {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(ReplayKeys, AreTold) {
  ReplayKeys keys;
  EXPECT_THAT(keys.On(" s."), ElementsAre(ReplayKey::kPause, ReplayKey::kStep, ReplayKey::kStep));
  EXPECT_THAT(keys.On("+=-"), ElementsAre(ReplayKey::kFaster, ReplayKey::kFaster, ReplayKey::kSlower));
  EXPECT_THAT(keys.On("q\x04"), ElementsAre(ReplayKey::kQuit, ReplayKey::kQuit));
}

TEST(ReplayKeys, AreArrowsInEitherMode) {
  ReplayKeys keys;
  EXPECT_THAT(keys.On("\x1b[A\x1b[B\x1b[C\x1b[D"),
              ElementsAre(ReplayKey::kForward10, ReplayKey::kBack10, ReplayKey::kForward1, ReplayKey::kBack1));
  EXPECT_THAT(keys.On("\x1bOC\x1b[1;5D"), ElementsAre(ReplayKey::kForward1, ReplayKey::kBack1));
}

TEST(ReplayKeys, MayComeInPieces) {
  ReplayKeys keys;
  EXPECT_THAT(keys.On("\x1b"), IsEmpty());
  EXPECT_THAT(keys.On("["), IsEmpty());
  EXPECT_THAT(keys.On("C"), ElementsAre(ReplayKey::kForward1));
}

TEST(ReplayKeys, PassOverOthers) {
  ReplayKeys keys;
  EXPECT_THAT(keys.On("xyz\x1b[5~\x1b[H\x1bx\r\n\xc3\xa4"), IsEmpty());
  EXPECT_THAT(keys.On("\x1b\x1b[C"), ElementsAre(ReplayKey::kForward1));
  EXPECT_THAT(keys.On("\x1b[" + std::string(1'000, '1')), IsEmpty());
  EXPECT_THAT(keys.On("\x1b[1 q"), testing::Not(testing::Contains(ReplayKey::kPause)));
  EXPECT_THAT(keys.On("q"), testing::Contains(ReplayKey::kQuit));
}

}  // namespace
}  // namespace axlecast
