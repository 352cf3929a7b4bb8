#include "tools/axlecast/device_data/parameter_diff.h"

#include <gmock/gmock.h>

#include "tools/axlecast/common/parameter_test_family.h"
#include "tools/axlecast/device_data/parameter_text.h"
#include "tools/axlecast/device_data/parameter_transfer.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Pair;
using ::testing::SizeIs;

const Parameters kAll = ParameterFamily().parameters;

ParameterValues Present() { return {{kAll.data(), 1'000}, {&kAll[1], 5}, {&kAll[2], 3'000}}; }

TEST(ParameterDiff, HoldsOnlyWhatDiffers) {
  const ParameterChanges changes = ParameterDiff(Present(), {{kAll.data(), 1'250}, {&kAll[1], 5}, {&kAll[2], 0}});
  ASSERT_THAT(changes, SizeIs(2));
  EXPECT_EQ(ToText(changes),
            "  power_limit     100.0 -> 125.0 W\n"
            "  shock_limit     30.00 -> 0.00 m/s2 (off)\n");
  EXPECT_EQ(ToJson(changes).dump(), R"([{"name":"power_limit","unit":"W","before":100.0,"after":125.0},)"
                                    R"({"name":"shock_limit","unit":"m/s2","before":30.0,"after":0.0}])");
}

TEST(ParameterDiff, EqualValuesAreNoChange) {
  EXPECT_THAT(ParameterDiff(Present(), Present()), IsEmpty());
  EXPECT_THAT(ParameterDiff(Present(), {}), IsEmpty());
  EXPECT_EQ(WriteText("gm3", {}, {}), "gm3: nothing to write\n");
  EXPECT_EQ(WriteJson("gm3", {}, {}).dump(),
            R"({"outcome":"succeeded","device":"gm3","changes":[],"commands":[]})");
}

// A command holds 16 arguments (messages.md).
TEST(WriteRequests, AreAsManyAsSixteenArgumentsEachNeed) {
  CommandOptions wish;
  wish.device = "gm3";
  wish.reason = "as at the trial";
  const auto requests = WriteRequests(wish, ParameterChanges(33, {kAll.data(), 1'000, 1'250}));
  ASSERT_THAT(requests, SizeIs(3));
  EXPECT_THAT(requests[0].arguments, SizeIs(16));
  EXPECT_THAT(requests[1].arguments, SizeIs(16));
  EXPECT_THAT(requests[2].arguments, ElementsAre(Pair("power_limit", "125.0")));
  EXPECT_EQ(requests[2].device, "gm3");
  EXPECT_EQ(requests[2].operation, "write_parameters");
  EXPECT_EQ(requests[2].reason, "as at the trial");
  EXPECT_THAT(WriteRequests(wish, {}), IsEmpty());
}

TEST(WriteText, TellsTheCommandThatFailedAndThoseBefore) {
  CommandResult done;
  done.answered = true;
  done.status.is_final = 1;
  done.status.verified = 1;
  done.status.state = command_status_t::STATE_SUCCEEDED;
  CommandResult failed = done;
  failed.status.state = command_status_t::STATE_FAILED;
  failed.status.text = "the unit refused a write";
  const ParameterChanges changes = {{kAll.data(), 1'000, 1'250}};
  EXPECT_EQ(WriteText("gm3", changes, {done}), "gm3: 1 parameters written and read back\n");
  EXPECT_THAT(WriteText("gm3", changes, {done, failed}), HasSubstr("the unit refused a write"));
  EXPECT_THAT(WriteText("gm3", changes, {done, failed}), HasSubstr("before it 1 commands were carried out"));
  EXPECT_EQ(WriteJson("gm3", changes, {done, failed})["outcome"], "failed");
}

}  // namespace
}  // namespace axlecast
