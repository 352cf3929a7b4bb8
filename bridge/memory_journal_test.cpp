#include "bridge/memory_journal.h"

#include <gtest/gtest.h>

#include "drivers/runtime/command/order_test_support.h"

namespace axlecast {
namespace {

using S = command_status_t;

TEST(MemoryJournal, RefusesRatherThanForgets) {
  MemoryJournal journal(2, 1);
  const auto status = [](std::uint32_t number, std::int8_t state) {
    S made{};
    const CommandId id = NumberedId(number);
    std::copy(id.begin(), id.end(), std::begin(made.id));
    made.state = state;
    made.body_digest = number;
    made.text = "text";
    return made;
  };
  EXPECT_TRUE(journal.Accepted(status(1, S::STATE_ACCEPTED), 0, 100));
  EXPECT_TRUE(journal.Accepted(status(2, S::STATE_ACCEPTED), 0, 200));
  EXPECT_FALSE(journal.Accepted(status(3, S::STATE_ACCEPTED), 99, 300));
  journal.Outcome(status(1, S::STATE_FAILED));
  journal.Outcome(status(2, S::STATE_SUCCEEDED));
  EXPECT_EQ(journal.Find(NumberedId(2))->text, "text");
  EXPECT_EQ(journal.Find(NumberedId(1))->state, S::STATE_FAILED);  // its details have gone
  EXPECT_EQ(journal.Find(NumberedId(1))->body_digest, 1);
  EXPECT_TRUE(journal.Accepted(status(3, S::STATE_ACCEPTED), 100, 300));  // the first one's time is over
  EXPECT_FALSE(journal.Find(NumberedId(1)));
}

}  // namespace
}  // namespace axlecast
