#include "tools/axlecast/common/program.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

TEST(ShellText, QuotesWhatAShellWouldChange) {
  EXPECT_EQ(ShellText({"env", "URL=udpm://239.255.76.67:7667?ttl=0", "a b", "it's", ""}),
            "env 'URL=udpm://239.255.76.67:7667?ttl=0' 'a b' 'it'\\''s' ''");
}

TEST(DriverProgram, FollowsTheFamilysName) {
  EXPECT_EQ(DriverProgram("tsubaki_sc"), ProgramFolder() + "/axlecast-tsubaki-sc");
}

}  // namespace
}  // namespace axlecast
