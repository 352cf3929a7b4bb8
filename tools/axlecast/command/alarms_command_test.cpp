#include "tools/axlecast/command/alarms_command.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <axlecast/alarm_t.hpp>

#include "tests/support/counting_family.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using E = alarm_entry_t;

constexpr std::int64_t kTime = 1'700'000'000'000'000;  // us: 2023-11-14 22:13:20

E Entry(const std::string& name, std::int8_t severity, std::int8_t state, std::int64_t first_utime = kTime) {
  E entry{};
  entry.name = name;
  entry.action = "Fix it.";
  entry.severity = severity;
  entry.state = state;
  entry.first_utime = first_utime;
  return entry;
}

AlarmMark Mark(AlarmMark::Kind kind, const std::string& alarm) {
  return {.kind = kind,
          .alarm = alarm,
          .utime = kTime,
          .until_utime = kTime + 3'600'000'000,
          .up_to = "error",
          .who = "local",
          .reason = "known"};
}

class AlarmListTest : public testing::Test {
 protected:
  AlarmListTest() {
    machine_.machine = "press3";
    machine_.buses = {CountingBus("b0", {"axis1", "axis2"})};
  }
  void Hear(MachineView& view, const std::string& device, const std::vector<E>& entries, int total) {
    device_info_t info{};
    info.device = device;
    view.OnMessage("DEVICE/" + device, Encoded(info), 1);
    alarm_t alarm{};
    alarm.device = device;
    alarm.entries = entries;
    alarm.n = static_cast<std::int8_t>(entries.size());
    alarm.total = static_cast<std::int16_t>(total);
    view.OnMessage("ALARM/" + device, Encoded(alarm), 1);
  }
  MachineConfig machine_;
};

TEST_F(AlarmListTest, WorstAndNewestFirstThenWhatHasGoneThenWhatIsShelved) {
  MachineView view(machine_);
  Hear(view, "axis1",
       {Entry("old", E::SEVERITY_ERROR, E::STATE_LIVE, kTime - 5),
        Entry("gone", E::SEVERITY_CRITICAL, E::STATE_UNACKNOWLEDGED),
        Entry("put_aside", E::SEVERITY_CRITICAL, E::STATE_SHELVED)},
       5);
  Hear(view, "axis2",
       {Entry("new", E::SEVERITY_ERROR, E::STATE_LIVE), Entry("mild", E::SEVERITY_INFO, E::STATE_LIVE)}, 2);
  const AlarmList list = MakeAlarmList(view, {}, 2);
  std::vector<std::string> names;
  for (const ListedAlarm& alarm : list.alarms) names.push_back(alarm.entry.name);
  EXPECT_EQ(names, (std::vector<std::string>{"new", "old", "mild", "gone", "put_aside"}));
  EXPECT_EQ(list.not_shown, 2);
  EXPECT_EQ(list.silent, std::vector<std::string>{"bridge"});
}

TEST_F(AlarmListTest, SaysWhoWhenAndWhy) {
  MachineView view(machine_);
  Hear(view, "axis1",
       {Entry("battery", E::SEVERITY_ERROR, E::STATE_LIVE), Entry("low", E::SEVERITY_WARNING, E::STATE_SHELVED)},
       2);
  const MarksByDevice marks = {
      {"axis1",
       {Mark(AlarmMark::Kind::kAcknowledged, "battery"), Mark(AlarmMark::Kind::kShelved, "low"),
        Mark(AlarmMark::Kind::kShelved, "absent")}}};
  const AlarmList list = MakeAlarmList(view, marks, 2);
  const std::string text = ToText(list);
  EXPECT_THAT(text, HasSubstr("acknowledged by local, 2023-11-14 22:13:20 UTC: known"));
  EXPECT_THAT(text, HasSubstr("shelved until 2023-11-14 23:13:20 UTC, up to severity error, by local"));
  EXPECT_THAT(text, HasSubstr("axis1 absent is not listed; shelved until"));
  EXPECT_THAT(text, HasSubstr("axis2 is silent: its alarms are not known"));
  const auto json = ToJson(list);
  EXPECT_EQ(json["alarms"][0]["acknowledged"]["who"], "local");
  EXPECT_EQ(json["alarms"][0]["shelved"], nullptr);
  EXPECT_EQ(json["alarms"][1]["shelved"]["until_utime"], kTime + 3'600'000'000);
  EXPECT_EQ(json["idle_shelves"][0]["alarm"], "absent");
  EXPECT_EQ(json["journal_problem"], nullptr);
}

TEST_F(AlarmListTest, NoneAtAll) {
  machine_.buses = {};
  const MachineView view(machine_);
  EXPECT_EQ(ToText(MakeAlarmList(view, {}, 2)), "bridge is silent: its alarms are not known\n");
  EXPECT_EQ(ToText({}), "no alarms\n");
}

}  // namespace
}  // namespace axlecast
