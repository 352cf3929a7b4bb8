#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bridge/store/store_fixture.h"

namespace axlecast {
namespace {

using SqliteJournalTest = StoreTest;
using S = command_status_t;

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
  EXPECT_TRUE(store->Accepted(Command(1), At(0)));
}

TEST_F(SqliteJournalTest, WhatWasNeverAcceptedIsPassedOver) {
  const auto store = OpenStore();
  store->Step(Moved(Command(1).status, S::STATE_RUNNING), At(0));
  store->Outcome(Moved(Command(1).status, S::STATE_SUCCEEDED), At(0));
  EXPECT_FALSE(store->Routed(Moved(Command(1).status, S::STATE_ROUTED), 1, At(0)));
  EXPECT_FALSE(store->Find(NumberedId(1)));
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
