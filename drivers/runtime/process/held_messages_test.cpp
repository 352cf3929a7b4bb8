#include "drivers/runtime/process/held_messages.h"

#include <gtest/gtest.h>

#include <array>

#include "tests/support/memory_sink.h"

namespace axlecast {
namespace {

class HeldMessagesTest : public ::testing::Test {
 protected:
  void Publish(std::uint8_t number) { held_.Publish("POSITION/axis1", std::array{number}); }
  [[nodiscard]] std::vector<std::uint8_t> Sent() const {
    std::vector<std::uint8_t> sent;
    for (const auto& message : sink_.Messages("POSITION/axis1"))
      sent.insert(sent.end(), message.begin(), message.end());
    return sent;
  }

  MemorySink sink_;
  HeldMessages held_{sink_};
};

TEST_F(HeldMessagesTest, SendsInOrderWhenReleasedAndOnceOnly) {
  Publish(1);
  Publish(2);
  EXPECT_EQ(Sent(), std::vector<std::uint8_t>());
  held_.Release();
  EXPECT_EQ(Sent(), (std::vector<std::uint8_t>{1, 2}));
  held_.Release();
  Publish(3);
  held_.Release();
  EXPECT_EQ(Sent(), (std::vector<std::uint8_t>{1, 2, 3}));
}

TEST_F(HeldMessagesTest, ManyMessagesKeepTheirOrderAndNoneIsLost) {
  std::vector<std::uint8_t> all;
  for (std::uint8_t i = 0; i < 100; ++i) {
    Publish(i);
    all.push_back(i);
  }
  EXPECT_LT(all.size() - Sent().size(), 20U);
  held_.Release();
  EXPECT_EQ(Sent(), all);
}

}  // namespace
}  // namespace axlecast
