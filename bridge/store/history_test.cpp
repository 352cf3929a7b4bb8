#include "bridge/store/history.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "bridge/store/store_fixture.h"
#include "core/command/commands.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using S = command_status_t;

class HistoryTest : public StoreTest {
 protected:
  // Numbers of the commands.
  static std::vector<int> Numbers(const std::vector<CommandRow>& commands) {
    std::vector<int> numbers;
    for (const CommandRow& command : commands) numbers.push_back(command.record.status.id[0]);
    return numbers;
  }
  std::vector<int> Find(const HistoryFilter& filter) {
    HistoryReader reader(file_);
    EXPECT_EQ(ErrorText(reader.state()), "");
    return Numbers(reader.Commands(filter));
  }

  // 1 to 6 on axis1 and axis2 in turn, accepted a microsecond after each other; 2 and 5 succeeded.
  std::unique_ptr<SqliteStore> Six() {
    auto store = OpenStore();
    for (std::uint32_t number = 1; number <= 6; ++number) {
      CommandRecord record = Command(number, number % 2 == 1 ? "axis1" : "axis2");
      if (number == 6) record.status.operation = "clear_errors";
      if (number == 3) record.who = "local";
      EXPECT_TRUE(store->Accepted(record, At(number)));
      if (number % 3 == 2) store->Outcome(Moved(record.status, S::STATE_SUCCEEDED), At(number + 0.5));
    }
    return store;
  }
};

TEST_F(HistoryTest, FiltersWhileTheBridgeWrites) {
  const auto store = Six();
  EXPECT_THAT(Find({}), ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(Find({.device = "axis2"}), ElementsAre(2, 4, 6));
  EXPECT_THAT(Find({.operation = "clear_errors"}), ElementsAre(6));
  EXPECT_THAT(Find({.who = "local"}), ElementsAre(3));
  EXPECT_THAT(Find({.state = S::STATE_SUCCEEDED}), ElementsAre(2, 5));
  EXPECT_THAT(Find({.since_utime = kStart + 2, .until_utime = kStart + 4}), ElementsAre(2, 3));
  EXPECT_THAT(Find({.limit = 2}), ElementsAre(5, 6));
  EXPECT_THAT(Find({.device = "axis1", .who = "plc", .limit = 1}), ElementsAre(5));
  EXPECT_THAT(Find({.id = "04"}), ElementsAre(4));
  EXPECT_THAT(Find({.id = IdText(NumberedId(4))}), ElementsAre(4));
  EXPECT_THAT(Find({.id = "0"}), ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(Find({.id = "f"}), IsEmpty());
  EXPECT_THAT(Find({.device = "'; DROP TABLE commands; --"}), IsEmpty());
}

TEST_F(HistoryTest, ReadsWithoutABridge) {
  Six().reset();
  HistoryReader reader(file_);
  EXPECT_EQ(reader.Machine(), "press3");
  const auto commands = reader.Commands({.id = "02"});
  ASSERT_EQ(commands.size(), 1U);
  EXPECT_EQ(commands[0].record.who, "plc");
  const auto steps = reader.Steps(commands[0].number);
  ASSERT_EQ(steps.size(), 2U);
  EXPECT_EQ(steps[0].state, S::STATE_ACCEPTED);
  EXPECT_EQ(steps[1].state, S::STATE_SUCCEEDED);
  EXPECT_EQ(steps[1].utime, kStart + 2'500'000);
  EXPECT_TRUE(reader.Steps(99).empty());
}

TEST_F(HistoryTest, FollowsOutcomesFindingsAndEvents) {
  const auto store = Six();
  HistoryReader reader(file_);
  HistoryReader::Mark from = reader.Now();
  EXPECT_THAT(Numbers(reader.Commands({}, HistoryReader::Mark{}, from)), ElementsAre(2, 5));
  store->Outcome(Moved(Command(1).status, S::STATE_INDETERMINATE), At(10));
  store->Note({kStart, "axis1", "moved_while_off", "text"});
  ASSERT_TRUE(store->Accepted(Command(7), At(10)));
  HistoryReader::Mark to = reader.Now();
  EXPECT_THAT(Numbers(reader.Commands({}, from, to)), ElementsAre(1));
  EXPECT_EQ(reader.Events({}, from, to).size(), 1U);
  EXPECT_TRUE(reader.Events({.device = "axis2"}, from, to).empty());
  from = to;
  S found = Moved(Command(1).status, S::STATE_INDETERMINATE);
  found.finding = S::FINDING_CANNOT_TELL;
  store->Outcome(found, At(11));
  to = reader.Now();
  EXPECT_THAT(Numbers(reader.Commands({}, from, to)), ElementsAre(1));
  EXPECT_TRUE(reader.Events({}, from, to).empty());
  EXPECT_THAT(Numbers(reader.Commands({.device = "axis2"}, from, to)), IsEmpty());
}

TEST_F(HistoryTest, DevicesAndTheirDatums) {
  const auto store = OpenStore();
  ASSERT_TRUE(store->Apply("axis1", DatumRecord{.counts = 1, .utime = kStart, .who = "plc"}));
  ASSERT_TRUE(store->Apply("axis1", DatumVoided{kStart + 1, "zeroed"}));
  ASSERT_TRUE(store->Apply("axis1", DatumRecord{.counts = 2, .utime = kStart + 2}));
  ASSERT_TRUE(store->Apply("axis1", DatumRecord{.counts = 3, .utime = kStart + 3}));
  ASSERT_TRUE(store->Apply("axis0", WritesAdded{5, kStart}));
  store->Note({kStart + 5, "axis1", "moved_while_off", "by 0.7 turns"});
  HistoryReader reader(file_);
  const auto devices = reader.Devices();
  ASSERT_EQ(devices.size(), 2U);
  EXPECT_EQ(devices[0].device, "axis0");
  EXPECT_EQ(devices[0].axis.writes, 5);
  EXPECT_FALSE(devices[0].axis.datum);
  EXPECT_EQ(devices[1].axis.datum->counts, 3);
  const auto datums = reader.Datums("axis1");
  ASSERT_EQ(datums.size(), 3U);
  EXPECT_TRUE(datums[0].in_force);
  EXPECT_FALSE(datums[1].in_force || datums[1].datum.voided_utime != 0);
  EXPECT_EQ(datums[2].datum.who, "plc");
  EXPECT_EQ(datums[2].datum.voided_utime, kStart + 1);
  EXPECT_EQ(datums[2].datum.void_reason, "zeroed");
  EXPECT_TRUE(reader.Datums("axis7").empty());
  ASSERT_EQ(reader.Events({.since_utime = kStart}).size(), 1U);
  EXPECT_EQ(reader.Events({})[0].kind, "moved_while_off");
  EXPECT_TRUE(reader.Events({.until_utime = kStart}).empty());
}

TEST_F(HistoryTest, AStepIsReadWhole) {
  const auto store = OpenStore();
  ASSERT_TRUE(store->Accepted(Command(1), At(0)));
  S status = WithChange(Moved(Command(1).status, S::STATE_INDETERMINATE, "fell silent"), "datum", "3", "4");
  status.finding = S::FINDING_NO_EFFECT_SEEN;
  status.reason_code = S::REASON_DRIVER_SILENT;
  status.progress = 0.25F;
  store->Outcome(status, At(1));
  status.verified = 1;
  store->Outcome(status, At(2));
  const auto steps = HistoryReader(file_).Steps(1);
  ASSERT_EQ(steps.size(), 3U);
  EXPECT_FALSE(steps[1].verified);
  EXPECT_EQ(steps[1].finding, S::FINDING_NO_EFFECT_SEEN);
  EXPECT_EQ(steps[1].reason_code, S::REASON_DRIVER_SILENT);
  EXPECT_EQ(steps[1].text, "fell silent");
  EXPECT_EQ(steps[1].progress, 0.25F);
  ASSERT_EQ(steps[1].changes.size(), 1U);
  EXPECT_EQ(steps[1].changes[0].key, "datum");
  EXPECT_EQ(steps[1].changes[0].before, "3");
  EXPECT_EQ(steps[1].changes[0].after, "4");
  EXPECT_TRUE(steps[2].verified);
}

TEST_F(HistoryTest, EventsAreReadOldestFirst) {
  const auto store = OpenStore();
  for (const int number : {1, 2, 3}) store->Note({kStart + number, "axis1", "kind", std::to_string(number)});
  HistoryReader reader(file_);
  const auto texts = [&reader](const HistoryFilter& filter) {
    std::string all;
    for (const AxisEvent& event : reader.Events(filter)) all += event.text;
    return all;
  };
  EXPECT_EQ(texts({}), "123");
  EXPECT_EQ(texts({.limit = 2}), "23");
  EXPECT_EQ(texts({.since_utime = kStart + 2}), "23");
  EXPECT_EQ(texts({.until_utime = kStart + 2}), "1");
}

// As a file that is damaged in one place: what is read from there fails, and the reader reports it.
TEST_F(HistoryTest, EachReadThatFailsIsReported) {
  using Read = std::function<bool(HistoryReader&)>;
  const std::vector<std::pair<std::string, Read>> reads = {
      {"commands RENAME COLUMN token", [](HistoryReader& reader) { return reader.Commands({}).empty(); }},
      {"steps RENAME COLUMN text", [](HistoryReader& reader) { return reader.Steps(1).empty(); }},
      {"events RENAME COLUMN kind", [](HistoryReader& reader) { return reader.Events({}).empty(); }},
      {"axes RENAME COLUMN identity", [](HistoryReader& reader) { return reader.Devices().empty(); }},
      {"alarm_marks RENAME COLUMN who", [](HistoryReader& reader) { return reader.AlarmMarks("axis1").empty(); }},
      {"datums RENAME COLUMN counts", [](HistoryReader& reader) { return reader.Datums("axis1").empty(); }},
      {"steps RENAME COLUMN number", [](HistoryReader& reader) { return reader.Now().step == 0; }},
      {"events RENAME COLUMN number", [](HistoryReader& reader) { return reader.Now().event == 0; }},
  };
  for (const auto& [damage, read] : reads) {
    for (const char* end : {"", "-wal", "-shm", "-guard"}) std::filesystem::remove(file_ + end);
    const auto store = OpenStore();
    ASSERT_TRUE(store->Accepted(Command(1), At(0)));
    ASSERT_TRUE(store->Apply("axis1", DatumRecord{.counts = 1}));
    ASSERT_TRUE(store->Apply("axis1", AlarmMark{.alarm = "battery_error"}));
    store->Note({kStart, "axis1", "moved_while_off", "text"});
    {
      HistoryReader reader(file_);
      EXPECT_FALSE(read(reader)) << damage;
      EXPECT_EQ(ErrorText(reader.state()), "") << damage;
    }
    ASSERT_EQ(Ask("ALTER TABLE " + damage + " TO away"), "");
    HistoryReader reader(file_);
    ASSERT_EQ(ErrorText(reader.state()), "");
    EXPECT_TRUE(read(reader)) << damage;
    EXPECT_THAT(ErrorText(reader.state()), HasSubstr("no such column")) << damage;
  }
}

TEST_F(HistoryTest, AFileThatCannotBeLookedAtIsNotMissing) {
  std::ofstream(folder_.path() + "/state") << "a file where a folder should be";
  EXPECT_EQ(ErrorText(HistoryReader(file_).state()), file_ + ": Not a directory");
}

TEST_F(HistoryTest, SaysWhyThereIsNothingToRead) {
  HistoryReader missing(file_);
  EXPECT_THAT(ErrorText(missing.state()),
              HasSubstr(file_ + " does not exist: the bridge writes it, at the place that `bridge: journal`"));
  EXPECT_TRUE(missing.Commands({}).empty());
  EXPECT_TRUE(missing.Devices().empty());
  EXPECT_TRUE(missing.Steps(1).empty());
  EXPECT_TRUE(missing.Events({}).empty());
  EXPECT_TRUE(missing.Datums("axis1").empty());
  EXPECT_TRUE(missing.AlarmMarks("axis1").empty());
  EXPECT_EQ(missing.Machine(), "");
  EXPECT_EQ(missing.Now().step, 0);
  EXPECT_EQ(missing.Now().event, 0);
  std::filesystem::create_directories(std::filesystem::path(file_).parent_path());
  std::ofstream(file_) << "";
  EXPECT_THAT(ErrorText(HistoryReader(file_).state()), HasSubstr("is no journal of axlecast"));
  EXPECT_EQ(Ask("CREATE TABLE meta (key, value); INSERT INTO meta VALUES ('schema_version', 9)"), "");
  EXPECT_THAT(ErrorText(HistoryReader(file_).state()), HasSubstr("newer axlecast"));
}

TEST_F(HistoryTest, DamageIsToldAndNoCrash) {
  {
    const auto store = OpenStore();
    for (std::uint32_t number = 1; number <= 100; ++number) ASSERT_TRUE(store->Accepted(Command(number), At(0)));
  }
  std::fstream file(file_, std::ios::in | std::ios::out | std::ios::binary);
  for (std::streamoff at = 4096; at < static_cast<std::streamoff>(std::filesystem::file_size(file_)); at += 97) {
    file.seekp(at).put('\xA5');
  }
  file.close();
  HistoryReader reader(file_);
  static_cast<void>(reader.Commands({}));
  static_cast<void>(reader.Devices());
  EXPECT_THAT(ErrorText(reader.state()), HasSubstr("it is damaged"));
}

}  // namespace
}  // namespace axlecast
