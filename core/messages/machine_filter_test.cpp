#include "core/messages/machine_filter.h"

#include <gtest/gtest.h>

#include <axlecast/bus_health_t.hpp>
#include <axlecast/permit_body_t.hpp>
#include <axlecast/position_t.hpp>

#include "core/messages/message.h"
#include "core/messages/origin.h"

namespace axlecast {
namespace {

std::vector<std::uint8_t> Position(std::string_view machine) {
  position_t message{};
  message.machine_id = machine.empty() ? 0 : NameHash(machine);
  return Encoded(message);
}

std::vector<std::uint8_t> Bus(const std::string& name, std::string_view machine) {
  bus_health_t message{};
  message.machine_id = NameHash(machine);
  message.machine = name;
  return Encoded(message);
}

TEST(MachineFilter, TakesItsOwnMachineAndWhatStatesNone) {
  const MachineFilter filter("press1");
  EXPECT_TRUE(filter.Takes(Position("press1")));
  EXPECT_TRUE(filter.Takes(Position("")));
  EXPECT_FALSE(filter.Takes(Position("press2")));
}

TEST(MachineFilter, WithoutAMachineTakesAll) { EXPECT_TRUE(MachineFilter("").Takes(Position("press2"))); }

// A type without a head, a type of others, and no message at all have any bytes where a head has the machine.
TEST(MachineFilter, TakesWhatIsNoPublishedTypeOfAxlecast) {
  const MachineFilter filter("press1");
  permit_body_t body{};
  body.device = std::string(60, 'x');
  EXPECT_TRUE(filter.Takes(Encoded(body)));
  EXPECT_TRUE(filter.Takes(std::vector<std::uint8_t>(200, 0x55)));
  for (std::size_t size = 0; size < 56; ++size) {
    const std::vector<std::uint8_t> whole = Position("press2");
    static_cast<void>(filter.Takes(Bytes(whole).first(size)));
  }
}

TEST(MachineFilter, ListsTheOthersAndTheirNames) {
  MachineFilter filter("press1");
  filter.Refuse(Position("press2"), kSecond);
  filter.Refuse(Position("press3"), kSecond);
  EXPECT_EQ(NamesOf(filter.Others(kSecond)).find("the machine with id"), 0U);
  filter.Refuse(Bus("press2", "press2"), 2 * kSecond);
  const std::vector<OtherMachine> others = filter.Others(2 * kSecond);
  ASSERT_EQ(others.size(), 2U);
  EXPECT_EQ(others[0].name, "press2");
  EXPECT_EQ(others[0].messages, 2);
  EXPECT_EQ(others[1].name, "");
}

TEST(MachineFilter, DoesNotBelieveANameOfAnotherId) {
  MachineFilter filter("press1");
  filter.Refuse(Bus("press3", "press2"), kSecond);
  EXPECT_EQ(filter.Others(kSecond)[0].name, "");
}

TEST(MachineFilter, ForgetsWhoHasGone) {
  MachineFilter filter("press1");
  filter.Refuse(Position("press2"), kSecond);
  EXPECT_EQ(filter.Others(kSecond + MachineFilter::kPresent).size(), 1U);
  EXPECT_TRUE(filter.Others(kSecond + MachineFilter::kPresent + 1).empty());
}

// Anybody can send invented machines.
TEST(MachineFilter, ItsListIsBounded) {
  MachineFilter filter("press1");
  for (int i = 0; i < 1'000; ++i) filter.Refuse(Position("m" + std::to_string(i)), kSecond);
  EXPECT_EQ(filter.Others(kSecond).size(), MachineFilter::kMaxOthers);
  filter.Refuse(Position("press2"), kSecond + MachineFilter::kPresent + 1);
  EXPECT_EQ(filter.Others(kSecond + MachineFilter::kPresent + 1).size(), 1U);
}

}  // namespace
}  // namespace axlecast
