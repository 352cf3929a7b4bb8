#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "bridge/store/rows.h"
#include "bridge/store/store_fixture.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using S = command_status_t;

class SqliteJournalTest : public StoreTest {
 protected:
  // In each change of the table, from now on.
  void PlantFailure(const std::string& what) const {
    ASSERT_EQ(Ask("CREATE TRIGGER fails BEFORE " + what + " BEGIN SELECT RAISE(ABORT, 'planted'); END"), "");
  }
  void LiftFailure() const { ASSERT_EQ(Ask("DROP TRIGGER fails"), ""); }

  // The file cannot be opened while this exists.
  void Block() const { std::ofstream(folder_.path() + "/state") << "a file where a folder should be"; }
  void Unblock() const { std::filesystem::remove(folder_.path() + "/state"); }

  static void RunMany(SqliteStore& store, std::uint32_t first, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      store.Step(Moved(Command(first + static_cast<std::uint32_t>(i)).status, S::STATE_RUNNING), At(0));
    }
  }
};

TEST_F(SqliteJournalTest, AnswersWhatItWasToldAlsoAfterARestart) {
  S last = WithChange(Moved(Command(1).status, S::STATE_SUCCEEDED, "read back: 0"), "position", "17.5 mm", "");
  last = WithChange(last, "sch\xc3\xb6n", "", "\"{}\n");
  last.verified = 1;
  last.is_unsigned = 1;
  last.progress = 0.25F;
  last.reason_code = S::REASON_NO_DATUM;
  last.driver_boot_id = INT64_MIN;
  last.started_utime = kStart + 1;
  last.finished_utime = kStart + 2;
  last.epoch_after = 4;
  last.token[15] = 9;
  CommandRecord record = Command(1);
  record.status.is_unsigned = 1;
  auto store = OpenStore();
  ASSERT_EQ(ErrorText(store->state()), "");
  ASSERT_TRUE(store->Accepted(record, At(0)));
  store->Outcome(last, At(1));
  for (int restart = 0; restart < 2; ++restart) {
    const auto found = store->Find(NumberedId(1));
    ASSERT_TRUE(found);
    // LCM's own encoding compares every field.
    last.is_final = 1;
    EXPECT_EQ(Encoded(*found), Encoded(last));
    EXPECT_FALSE(store->Find(NumberedId(2)));
    store.reset();
    store.reset();
    store = OpenStore();
  }
}

TEST_F(SqliteJournalTest, WhatAnswersTrueOutlivesACrash) {
  const auto store = OpenStore();
  ASSERT_TRUE(store->Accepted(Command(1), At(0)));
  EXPECT_EQ(SqliteStore(Copy(), "press3").Find(NumberedId(1))->state, S::STATE_ACCEPTED);
  S routed = Moved(Command(1).status, S::STATE_ROUTED);
  routed.driver_boot_id = 5;
  ASSERT_TRUE(store->Routed(routed, 12, At(1)));
  const auto open = SqliteStore(Copy(), "press3").Open();
  ASSERT_EQ(open.size(), 1U);
  EXPECT_EQ(open[0].record.status.driver_boot_id, 5);
  EXPECT_EQ(open[0].sent_epoch, 12);
  store->Outcome(Moved(routed, S::STATE_INDETERMINATE), At(2));
  EXPECT_EQ(SqliteStore(Copy(), "press3").Find(NumberedId(1))->state, S::STATE_INDETERMINATE);
  S found = Moved(routed, S::STATE_INDETERMINATE);
  found.finding = S::FINDING_EFFECT_SEEN;
  store->Outcome(found, At(3));
  EXPECT_EQ(SqliteStore(Copy(), "press3").Find(NumberedId(1))->finding, S::FINDING_EFFECT_SEEN);
}

TEST_F(SqliteJournalTest, AnIdIsAcceptedOnce) {
  const auto store = OpenStore();
  ASSERT_TRUE(store->Accepted(Command(1), At(0)));
  EXPECT_FALSE(store->Accepted(Command(1, "axis2"), At(1)));
  store->Outcome(Moved(Command(1).status, S::STATE_FAILED), At(2));
  EXPECT_FALSE(store->Accepted(Command(1), At(3)));
  EXPECT_EQ(store->Find(NumberedId(1))->device, "axis1");
  EXPECT_EQ(store->Find(NumberedId(1))->state, S::STATE_FAILED);
  EXPECT_EQ(ErrorText(store->state()), "");
}

TEST_F(SqliteJournalTest, OneThatWasRefusedIsNotedWithItsOutcome) {
  const auto store = OpenStore();
  CommandRecord refused = Command(1);
  refused.status = Moved(refused.status, S::STATE_REJECTED, "no permit");
  ASSERT_TRUE(store->Accepted(refused, At(0)));
  EXPECT_EQ(OpenStore()->Find(NumberedId(1))->is_final, 1);
  EXPECT_TRUE(OpenStore()->Open().empty());
}

TEST_F(SqliteJournalTest, StepsWaitForTheNextCommitOrTick) {
  const auto store = OpenStore();
  ASSERT_TRUE(store->Accepted(Command(1), At(0)));
  store->Tick(At(0));
  store->Step(Moved(Command(1).status, S::STATE_RUNNING, "turn 1"), At(1));
  EXPECT_EQ(store->Find(NumberedId(1))->text, "turn 1");
  EXPECT_EQ(SqliteStore(Copy(), "press3").Find(NumberedId(1))->state, S::STATE_ACCEPTED);
  store->Tick(At(1.1));
  EXPECT_EQ(SqliteStore(Copy(), "press3").Find(NumberedId(1))->text, "turn 1");
  store->Step(Moved(Command(1).status, S::STATE_RUNNING, "turn 2"), At(1.11));
  store->Tick(At(1.19));  // within 100 ms of the last write
  EXPECT_EQ(SqliteStore(Copy(), "press3").Find(NumberedId(1))->text, "turn 1");
  ASSERT_TRUE(store->Accepted(Command(2), At(1.19)));
  EXPECT_EQ(SqliteStore(Copy(), "press3").Find(NumberedId(1))->text, "turn 2");
}

TEST_F(SqliteJournalTest, OpenAreThoseOfAnEarlierBridgeOldestFirst) {
  auto store = OpenStore();
  for (const std::uint32_t number : {9U, 3U, 5U}) ASSERT_TRUE(store->Accepted(Command(number), At(0)));
  store->Outcome(Moved(Command(3).status, S::STATE_SUCCEEDED), At(1));
  ASSERT_TRUE(store->Routed(Moved(Command(5).status, S::STATE_ROUTED), 3, At(1)));
  ASSERT_TRUE(store->Routed(Moved(Command(5).status, S::STATE_ROUTED), 7, At(1)));
  EXPECT_TRUE(store->Open().empty());  // its own
  store.reset();
  store = OpenStore();
  ASSERT_TRUE(store->Accepted(Command(11), At(2)));
  const auto open = store->Open();
  ASSERT_EQ(open.size(), 2U);
  EXPECT_EQ(open[0].record.status.id[0], 9);
  EXPECT_EQ(open[0].sent_epoch, 0);
  EXPECT_EQ(open[0].record.who, "plc");
  EXPECT_EQ(open[0].record.key_id, INT64_MIN);
  EXPECT_EQ(open[0].record.reason, "homing");
  EXPECT_EQ(open[0].record.bridge_boot_id, 77);
  EXPECT_EQ(open[0].record.utime, kStart + 9);
  EXPECT_EQ(open[0].record.begin_by_utime, kStart + 5'000'000);
  ASSERT_EQ(open[0].record.arguments.size(), 1U);
  EXPECT_EQ(open[0].record.arguments[0].value, "123.456");
  EXPECT_EQ(open[1].record.status.id[0], 5);
  EXPECT_EQ(open[1].sent_epoch, 7);
  store->Outcome(Moved(open[0].record.status, S::STATE_EXPIRED), At(3));
  EXPECT_EQ(store->Open().size(), 1U);
}

TEST_F(SqliteJournalTest, EpochsAreReservedOnce) {
  auto store = OpenStore();
  EXPECT_EQ(store->ReserveEpochs(0, 100), 1);
  EXPECT_EQ(store->ReserveEpochs(0, 100), 101);
  store.reset();
  store = OpenStore();
  EXPECT_EQ(store->ReserveEpochs(50, 10), 201);
  EXPECT_EQ(store->ReserveEpochs(1'000, 10), 1'000);
  EXPECT_EQ(store->ReserveEpochs(0, 1), 1'010);
  EXPECT_EQ(store->ReserveEpochs(0, 0), 0);
  EXPECT_EQ(store->ReserveEpochs(0, -1), 0);
  EXPECT_EQ(store->ReserveEpochs(INT64_MAX, 1), 0);
  EXPECT_EQ(store->ReserveEpochs(INT64_MAX - 10, 10), INT64_MAX - 10);
  EXPECT_EQ(store->ReserveEpochs(0, 1), 0) << "none is left";
  EXPECT_EQ(store->ReserveEpochs(0, 2), 0);
  EXPECT_TRUE(store->Accepted(Command(1), At(0)));
}

TEST_F(SqliteJournalTest, WhatWasNeverAcceptedIsPassedOver) {
  const auto store = OpenStore();
  store->Step(Moved(Command(1).status, S::STATE_RUNNING), At(0));
  store->Outcome(Moved(Command(1).status, S::STATE_SUCCEEDED), At(0));
  EXPECT_FALSE(store->Routed(Moved(Command(1).status, S::STATE_ROUTED), 1, At(0)));
  EXPECT_FALSE(store->Find(NumberedId(1)));
  EXPECT_EQ(Ask("SELECT count(*) FROM meta WHERE key = 'changes'"), "0\n") << "nothing was written";
  EXPECT_TRUE(store->Accepted(Command(1), At(1)));
}

TEST_F(SqliteJournalTest, AnotherProgramReadsEveryStep) {
  const auto store = OpenStore();
  ASSERT_TRUE(store->Accepted(Command(1), At(0)));
  S status = Moved(Command(1).status, S::STATE_ROUTED);
  ASSERT_TRUE(store->Routed(status, 1, At(1)));
  status = Moved(status, S::STATE_RUNNING, "waits for standstill");
  store->Step(status, At(2));
  status.progress = 0.5F;
  store->Step(status, At(3));  // no row of its own
  status.text = "writes";
  store->Step(status, At(4));
  status = WithChange(Moved(status, S::STATE_INDETERMINATE, "the driver fell silent"), "datum", "3", "4");
  store->Outcome(status, At(5));
  status.finding = S::FINDING_EFFECT_SEEN;
  store->Outcome(status, At(6));
  EXPECT_EQ(
      Ask("SELECT (utime - 1700000000000000) / 1000000, s.word, f.word, t.text, json_extract(t.changes, "
          "'\\$[0].after') FROM steps t JOIN words s ON s.kind = 'state' AND s.number = state JOIN words f ON "
          "f.kind = 'finding' AND f.number = finding WHERE command = 1 ORDER BY t.number"),
      "0|accepted|none||\n"
      "1|routed|none||\n"
      "2|running|none|waits for standstill|\n"
      "4|running|none|writes|\n"
      "5|indeterminate|none|the driver fell silent|4\n"
      "6|indeterminate|effect_seen|the driver fell silent|4\n");
  EXPECT_EQ(Ask("SELECT time, id, who, device, operation, json_extract(arguments, '\\$[0].value'), outcome, found, "
                "reason FROM history"),
            "2023-11-14 22:13:20|01000000000000000000000000000000|plc|axis1|set_datum|123.456|indeterminate|"
            "effect_seen|homing\n");
  EXPECT_EQ(Ask("SELECT key, value FROM meta WHERE key IN ('machine', 'schema_version')"),
            "machine|press3\nschema_version|1\n");
  EXPECT_EQ(Ask("PRAGMA integrity_check; PRAGMA foreign_key_check"), "ok\n");
}

TEST_F(SqliteJournalTest, EachChangeButThatOfTheProgressIsAStep) {
  const auto store = OpenStore();
  ASSERT_TRUE(store->Accepted(Command(1), At(0)));
  S status = Moved(Command(1).status, S::STATE_INDETERMINATE);
  int steps = 1;
  const auto expect = [&](int more, const char* what) {
    store->Outcome(status, At(1));
    steps += more;
    EXPECT_EQ(Ask("SELECT count(*) FROM steps"), std::to_string(steps) + "\n") << what;
  };
  expect(1, "state");
  expect(0, "the same again");
  status.verified = 1;
  expect(1, "verified");
  status.finding = S::FINDING_EFFECT_SEEN;
  expect(1, "finding");
  status.reason_code = S::REASON_DRIVER_SILENT;
  expect(1, "reason");
  status.text = "text";
  expect(1, "text");
  status = WithChange(status, "datum", "3", "4");
  expect(1, "one change more");
  expect(0, "the same changes");
  status.changes[0].key = "position";
  expect(1, "key");
  status.changes[0].before = "2";
  expect(1, "before");
  status.changes[0].after = "5";
  expect(1, "after");
  status.progress = 0.5F;
  expect(0, "progress");
}

TEST_F(SqliteJournalTest, ACommandIsAcceptedWholeOrNotAtAll) {
  const auto store = OpenStore();
  for (const char* what : {"INSERT ON commands", "UPDATE ON commands", "INSERT ON steps"}) {
    PlantFailure(what);
    EXPECT_FALSE(store->Accepted(Command(1), At(0))) << what;
    EXPECT_THAT(ErrorText(store->state()), HasSubstr("planted")) << what;
    EXPECT_EQ(Ask("SELECT * FROM commands; SELECT * FROM steps"), "") << what;
    LiftFailure();
  }
  EXPECT_TRUE(store->Accepted(Command(1), At(0)));
}

TEST_F(SqliteJournalTest, AnOutcomeThatCannotBeWrittenIsWrittenLater) {
  const auto store = OpenStore();
  double seconds = 10;
  std::uint32_t number = 0;
  for (const char* what : {"UPDATE ON commands", "INSERT ON steps"}) {
    ASSERT_TRUE(store->Accepted(Command(++number), At(seconds)));
    PlantFailure(what);
    store->Outcome(Moved(Command(number).status, S::STATE_SUCCEEDED), At(seconds));
    EXPECT_THAT(ErrorText(store->state()), HasSubstr("planted")) << what;
    LiftFailure();
    store->Tick(At(seconds + 5));
    EXPECT_EQ(Ask("SELECT c.state, count(*) FROM commands c JOIN steps ON command = c.number GROUP BY c.number"),
              number == 1 ? "4|2\n" : "4|2\n4|2\n")
        << what;
    seconds += 10;
  }
  // Refused, and done all the same.
  PlantFailure("INSERT ON commands");
  EXPECT_FALSE(store->Accepted(Command(3), At(seconds)));
  store->Outcome(Moved(Command(3).status, S::STATE_SUCCEEDED), At(seconds));
  EXPECT_THAT(ErrorText(store->state()), HasSubstr("planted"));
  LiftFailure();
  store->Tick(At(seconds + 5));
  EXPECT_EQ(Ask("SELECT state FROM commands WHERE id LIKE '03%'"), "4\n");
}

TEST_F(SqliteJournalTest, TheOutcomeOfItsOwnCommandIsRememberedAlsoIfTheTableCannotBeRead) {
  const auto store = OpenStore();
  ASSERT_TRUE(store->Accepted(Command(1), At(0)));
  ASSERT_EQ(Ask("ALTER TABLE commands RENAME COLUMN token TO away"), "");
  EXPECT_FALSE(store->Find(NumberedId(1)));
  store->Outcome(Moved(Command(1).status, S::STATE_SUCCEEDED), At(1));
  EXPECT_EQ(store->Find(NumberedId(1))->state, S::STATE_SUCCEEDED);
  ASSERT_EQ(Ask("ALTER TABLE commands RENAME COLUMN away TO token"), "");
  store->Tick(At(10));
  EXPECT_EQ(Ask("SELECT state FROM commands"), "4\n");
}

TEST_F(SqliteJournalTest, OfStepsThatWaitTheLastIsReplaced) {
  const auto store = OpenStore();
  ASSERT_TRUE(store->Accepted(Command(1), At(0)));
  for (const int last : {100, 203}) {
    for (int number = 1; number <= last; ++number) {
      store->Step(Moved(Command(1).status, S::STATE_RUNNING, std::to_string(last + number)), At(1));
    }
    store->Tick(At(last));
    EXPECT_EQ(Ask("SELECT count(*), max(CAST(text AS INTEGER)) FROM steps WHERE state = 3"),
              last == 100 ? "100|200\n" : "200|406\n");
    EXPECT_EQ(Ask("SELECT text FROM steps ORDER BY number DESC LIMIT 2"),
              last == 100 ? "200\n199\n" : "406\n302\n");
  }
}

TEST_F(SqliteJournalTest, OfCommandsThatWereRefusedTheNewestAreRemembered) {
  const auto store = OpenStore();
  PlantFailure("INSERT ON commands");
  const auto refuse = [&](std::uint32_t number) { EXPECT_FALSE(store->Accepted(Command(number), At(0))); };
  const auto is_noted = [&](std::uint32_t number) {
    store->Step(Moved(Command(number).status, S::STATE_RUNNING), At(0));
    return store->Find(NumberedId(number)).has_value();
  };
  for (std::uint32_t number = 1; number <= 256; ++number) refuse(number);
  refuse(256);
  EXPECT_TRUE(is_noted(2));
  refuse(257);
  EXPECT_TRUE(is_noted(1)) << "256 are remembered, as one has been noted";
  refuse(258);
  refuse(259);
  refuse(260);
  EXPECT_FALSE(is_noted(3)) << "the oldest";
  EXPECT_FALSE(is_noted(4));
  EXPECT_TRUE(is_noted(5));
  EXPECT_TRUE(is_noted(259));
}

TEST_F(SqliteJournalTest, OfCommandsOfWhichNothingIsKnownTheNewestAreRemembered) {
  Block();
  const auto store = OpenStore();
  RunMany(*store, 1, SqliteJournal::kMaxUnnoted);
  EXPECT_TRUE(store->Find(NumberedId(1)));
  RunMany(*store, 20'000, 2);
  EXPECT_FALSE(store->Find(NumberedId(1))) << "the oldest";
  EXPECT_FALSE(store->Find(NumberedId(2)));
  EXPECT_TRUE(store->Find(NumberedId(3)));
  EXPECT_TRUE(store->Find(NumberedId(20'000)));
}

TEST_F(SqliteJournalTest, ItsOwnCommandIsRememberedUntilItHasEnded) {
  const auto store = OpenStore();
  ASSERT_TRUE(store->Accepted(Command(1), At(0)));
  ASSERT_TRUE(store->Accepted(Command(2), At(0)));
  store->Outcome(Moved(Command(2).status, S::STATE_INDETERMINATE), At(0));
  std::filesystem::remove_all(folder_.path() + "/state");
  store->Step(Moved(Command(1).status, S::STATE_RUNNING), At(1));
  S found = Moved(Command(2).status, S::STATE_INDETERMINATE);
  found.finding = S::FINDING_EFFECT_SEEN;
  store->Outcome(found, At(1));
  EXPECT_FALSE(store->readable());
  RunMany(*store, 10, SqliteJournal::kMaxUnnoted);
  EXPECT_TRUE(store->Find(NumberedId(1)));
  EXPECT_FALSE(store->Find(NumberedId(2)));
}

TEST_F(SqliteJournalTest, WhatWasWrittenTakesNoRoomOfWhatWaits) {
  Block();
  const auto store = OpenStore();
  const std::uint32_t last = 0xFFFF'FFFF;  // in the order in which they are written
  RunMany(*store, last, 1);
  RunMany(*store, 1, SqliteJournal::kBatch);
  Unblock();
  store->Tick(At(10));
  ASSERT_EQ(ErrorText(store->state()), "");
  EXPECT_FALSE(store->Find(NumberedId(1))) << "it was never accepted";
  EXPECT_TRUE(store->Find(NumberedId(last)));
  std::filesystem::remove_all(folder_.path() + "/state");
  EXPECT_FALSE(store->Accepted(Command(1'000), At(10)));
  RunMany(*store, 1'001, SqliteJournal::kMaxUnnoted - 1);
  EXPECT_TRUE(store->Find(NumberedId(last)));
}

TEST_F(SqliteJournalTest, WhatMustBeWrittenNowPassesWhatWaits) {
  const auto store = OpenStore();
  const auto count = static_cast<std::uint32_t>(SqliteJournal::kBatch + 20);
  for (std::uint32_t number = 1; number <= count; ++number) ASSERT_TRUE(store->Accepted(Command(number), At(0)));
  for (std::uint32_t number = 1; number <= count; ++number) {
    store->Step(Moved(Command(number).status, S::STATE_RUNNING), At(1));
  }
  store->Outcome(Moved(Command(count).status, S::STATE_SUCCEEDED), At(1));
  EXPECT_EQ(Ask("SELECT state FROM commands WHERE number = " + std::to_string(count)), "4\n");
  EXPECT_EQ(Ask("SELECT count(*) FROM commands WHERE state = 1"), "20\n");
  EXPECT_EQ(Ask("SELECT count(*) FROM steps WHERE command = " + std::to_string(count)), "3\n") << "once each";
}

TEST_F(SqliteJournalTest, WhatWaitsIsWrittenAtTheEnd) {
  auto store = OpenStore();
  const auto count = static_cast<std::uint32_t>(SqliteJournal::kBatch + 20);
  for (std::uint32_t number = 1; number <= count; ++number) ASSERT_TRUE(store->Accepted(Command(number), At(0)));
  for (std::uint32_t number = 1; number <= count; ++number) {
    store->Step(Moved(Command(number).status, S::STATE_RUNNING), At(1));
  }
  store.reset();
  EXPECT_EQ(Ask("SELECT count(*) FROM commands WHERE state = 3"), std::to_string(count) + "\n");
}

TEST_F(SqliteJournalTest, OpenAreAnsweredAsTheyWereNotedLast) {
  for (const std::uint32_t number : {1U, 2U, 3U}) ASSERT_TRUE(OpenStore()->Accepted(Command(number), At(0)));
  const auto store = OpenStore();
  ASSERT_EQ(store->Open().size(), 3U);
  ASSERT_TRUE(store->Routed(Moved(Command(1).status, S::STATE_ROUTED), 8, At(1)));
  PlantFailure("UPDATE ON commands");
  EXPECT_FALSE(store->Routed(Moved(Command(1).status, S::STATE_ROUTED, "again"), 7, At(1)));
  EXPECT_FALSE(store->Routed(Moved(Command(2).status, S::STATE_ROUTED, "first"), 9, At(1)));
  store->Outcome(Moved(Command(3).status, S::STATE_SUCCEEDED), At(1));
  const auto open = store->Open();
  ASSERT_EQ(open.size(), 2U) << "without the one that has ended";
  EXPECT_EQ(open[0].record.status.text, "again");
  EXPECT_EQ(open[0].sent_epoch, 8);
  EXPECT_EQ(open[1].record.status.text, "first");
  EXPECT_EQ(open[1].sent_epoch, 9);
  EXPECT_EQ(store->Find(NumberedId(1))->text, "again");
}

// A bridge that was killed between the outcome and its finding: the next one has to find out.
TEST_F(SqliteJournalTest, AnIndeterminateCommandIsOpenUntilItHasItsFinding) {
  command_status_t status = Moved(Command(1).status, S::STATE_INDETERMINATE);
  {
    const auto store = OpenStore();
    ASSERT_TRUE(store->Accepted(Command(1), At(0)));
    store->Outcome(status, At(1));
  }
  ASSERT_EQ(OpenStore()->Open().size(), 1U);
  EXPECT_EQ(OpenStore()->Open()[0].record.status.state, S::STATE_INDETERMINATE);
  status.finding = S::FINDING_CANNOT_TELL;
  {
    const auto store = OpenStore();
    PlantFailure("UPDATE ON commands");
    store->Outcome(status, At(2));
    EXPECT_TRUE(store->Open().empty()) << "it has its finding, which waits for the disk";
    LiftFailure();
    store->Tick(At(10));
  }
  EXPECT_TRUE(OpenStore()->Open().empty());
}

TEST_F(SqliteJournalTest, TheHighestEpochOfACommandIsKept) {
  const auto store = OpenStore();
  ASSERT_TRUE(store->Accepted(Command(1), At(0)));
  PlantFailure("UPDATE ON commands");
  for (const std::int64_t epoch : {4, 9, 6}) {
    EXPECT_FALSE(store->Routed(Moved(Command(1).status, S::STATE_ROUTED), epoch, At(1)));
  }
  LiftFailure();
  store->Tick(At(10));
  EXPECT_EQ(Ask("SELECT sent_epoch FROM commands"), "9\n");
}

// Columns of lists that another program has changed.
TEST_F(SqliteJournalTest, AListThatIsNoneIsReadAsEmpty) {
  ASSERT_TRUE(OpenStore()->Accepted(Command(1), At(0)));
  const std::pair<std::string, std::vector<std::string>> lists[] = {
      {"no JSON", {}},
      {"{\"a\": {\"key\": \"k\"}}", {}},
      {"7", {}},
      {"[]", {}},
      {"[7, \"x\", {}, {\"key\": 5}, {\"key\": \"k\"}]", {"", "", "", "", "k"}},
  };
  for (const auto& [text, keys] : lists) {
    std::vector<std::string> found;
    for (const change_t& change : ParseChanges(text)) found.push_back(change.key);
    EXPECT_EQ(found, keys) << text;
    const auto opened = Database::Open(file_, Database::Access::kReadWrite);
    ASSERT_TRUE(opened && (*opened)->Execute("UPDATE commands SET arguments = ?", {std::string_view(text)}));
    found.clear();
    const auto open = OpenStore()->Open();
    ASSERT_EQ(open.size(), 1U);
    for (const argument_t& argument : open[0].record.arguments) found.push_back(argument.key);
    EXPECT_EQ(found, keys) << text;
  }
}

TEST_F(SqliteJournalTest, ChangesAreAsManyAsAMessageHolds) {
  std::vector<change_t> changes(128);
  changes[126].key = "last";
  const auto read = ParseChanges(ChangesText(changes));
  ASSERT_EQ(read.size(), 127U);
  EXPECT_EQ(read.back().key, "last");
}

TEST_F(SqliteJournalTest, ATokenIsNotedIfThereIsOne) {
  const auto store = OpenStore();
  S status = Moved(Command(1).status, S::STATE_SUCCEEDED);
  EXPECT_EQ(TokenText(status), "");
  status.token[0] = 0xAB;
  EXPECT_EQ(TokenText(status), "ab000000000000000000000000000000");
}

TEST_F(SqliteJournalTest, BytesThatAreNoTextHarmNothing) {
  const auto store = OpenStore();
  CommandRecord record = Command(1, "\xff\xfe'; DROP TABLE commands; --");
  record.arguments[0].value = "\xc3";
  record.reason = std::string("a\0b", 3);
  ASSERT_TRUE(store->Accepted(record, At(0)));
  EXPECT_EQ(OpenStore()->Find(NumberedId(1))->device, record.status.device);
  EXPECT_EQ(OpenStore()->Open()[0].record.arguments[0].value, "\xEF\xBF\xBD");
}

}  // namespace
}  // namespace axlecast
