// Replies that come up to ten timeouts late, and streams that stall, on every bus on which something can be late: the
// interval of every reading must hold an instant at which the device truly had that value.
#include <gtest/gtest.h>

#include "tests/conformance/example_buses.h"
#include "tests/conformance/late_replies.h"

namespace axlecast {
namespace {

class LateReplies : public ExampleTest {};

TEST_P(LateReplies, EveryReadingLiesWithinItsInterval) {
  ASSERT_NE(bus_, nullptr);
  std::int64_t readings = 0;
  for (const LateMix mix : kLateMixes) {
    LateRun run(*machine_, *bus_, secrets_, mix);
    run.Exchange(2'000);
    EXPECT_EQ(run.missed(), 0) << MixName(mix) << ": worst by " << run.worst() / kMicrosecond << " us";
    readings += run.readings();
  }
  EXPECT_GT(readings, 500);
}

TEST_P(LateReplies, TheBoundIsAtLeastHalfASecond) {
  ASSERT_NE(bus_, nullptr);
  EXPECT_GE(bus_->late, 500 * kMillisecond);
}

// Not those that are clocked.
std::vector<ExampleBus> BusesWithLateReplies() {
  std::vector<ExampleBus> buses;
  for (const ExampleBus& example : ExampleBuses()) {
    ConfigErrors errors(example.file);
    const auto machine = LoadConfig(example.file, errors);
    if (machine && machine->FindBus(example.bus)->late > 0) buses.push_back(example);
  }
  return buses;
}

INSTANTIATE_TEST_SUITE_P(Family, LateReplies, testing::ValuesIn(BusesWithLateReplies()), NameOf);

}  // namespace
}  // namespace axlecast
