#include "drivers/tformat/operations.h"

#include <axlecast/command_status_t.hpp>

#include "drivers/tformat/device_test_support.h"

namespace axlecast::tformat {
namespace {

using Reason = command_status_t;
using Arguments = std::vector<std::pair<std::string, std::string>>;

constexpr const char* kWritable = "{model: ts5669n127, eeprom_writable: [10, 11, 12]}";

ByteList ReadRequest(std::uint8_t address) { return Checked({0xEA, address}); }
ByteList WriteRequest(std::uint8_t address, std::uint8_t data) { return Checked({0x32, address, data}); }
ByteList WriteBusy(std::uint8_t address) { return Checked({0x32, static_cast<std::uint8_t>(address | 0x80), 0}); }

// Reads all cells; each holds its address.
void Backup(DeviceFixture& bench) {
  for (std::uint8_t cell = 0; cell < 80; ++cell) bench.Give(ReadRequest(cell), Cell(cell, cell), false);
}

void Wait(DeviceFixture& bench) {
  if (bench.IsIdle(false)) bench.now = bench.IdleUntil(false);
}

// Spec 6.2.2, 6.2.3, 6.3.4: to write 55 to address 0, byte by byte, with the CRC worked by hand.
TEST(EepromWrite, TheBytesOfAWriteToAddressZero) {
  DeviceFixture bench("{model: ts5669n127, eeprom_writable: [0]}");
  bench.GoOnline();
  bench.Begin("eeprom_write", {{"address", "0"}, {"data", "55"}});
  EXPECT_EQ(bench.Offered(false), (ByteList{0xEA, 0x00, 0xEA})) << "the backup begins";
  Backup(bench);
  EXPECT_EQ(bench.Offered(false), (ByteList{0x32, 0x00, 0x55, 0x67}));
}

TEST(EepromWrite, BacksUpWritesEachCellOnceAndReadsItBack) {
  DeviceFixture bench(kWritable);
  bench.GoOnline();
  bench.Begin("eeprom_write", {{"address", "10"}, {"data", "A1 0B 05"}});
  Backup(bench);
  bench.requests.clear();
  bench.Give(WriteRequest(10, 0xA1), WriteRequest(10, 0xA1), false);  // accepted: the same bytes
  const MonoNs accepted = bench.now;
  Wait(bench);
  EXPECT_GE(bench.now - accepted, 18 * kMillisecond);
  bench.Give(ReadRequest(10), Cell(10, 0xA1), false);
  bench.Give(WriteRequest(12, 0x05), WriteRequest(12, 0x05), false);  // cell 11 holds 0B already
  Wait(bench);
  bench.Give(ReadRequest(12), Cell(12, 0x05), false);
  const Outcome& outcome = bench.Last();
  EXPECT_EQ(outcome.state, CommandState::kSucceeded);
  EXPECT_TRUE(outcome.verified);
  EXPECT_EQ(bench.output.non_volatile_writes, 2);
  ASSERT_EQ(outcome.changes.size(), 4u);
  EXPECT_EQ(outcome.changes[0].key, "eeprom_0");
  EXPECT_EQ(outcome.changes[0].before, "00 01 02 03 04 05 06 07 08 09 0A 0B 0C 0D 0E 0F 10 11 12 13");
  EXPECT_EQ(outcome.changes[0].after, "00 01 02 03 04 05 06 07 08 09 A1 0B 05 0D 0E 0F 10 11 12 13");
  EXPECT_EQ(outcome.changes[3].key, "eeprom_60");
  for (const Change& change : outcome.changes) EXPECT_LE(change.before.size(), 80u);
  EXPECT_LE(outcome.text.size(), 200u);
}

TEST(EepromWrite, LiveReadingsGoOnWhileItWaits) {
  DeviceFixture bench(kWritable);
  bench.GoOnline();
  bench.Begin("eeprom_write", {{"address", "10"}, {"data", "A1"}});
  bench.Give(ReadRequest(0), Cell(0, 0));
  bench.Give(kId3, All());  // a slot is due: readings are not kept waiting by 80 cells
  bench.Give(ReadRequest(1), Cell(1, 1));
}

TEST(EepromWrite, IsDeniedForCellsThatTheConfigurationDoesNotList) {
  for (const auto& [address, data] : {std::pair{"9", "00"}, {"11", "00 00 00"}, {"79", "00"}}) {
    DeviceFixture bench(kWritable);
    bench.GoOnline();
    bench.Begin("eeprom_write", {{"address", address}, {"data", data}});
    EXPECT_EQ(bench.Last().state, CommandState::kRejected);
    EXPECT_EQ(bench.Last().reason, Reason::REASON_NOT_PERMITTED);
    EXPECT_NE(bench.Last().text.find("eeprom_writable"), std::string::npos);
  }
}

TEST(EepromWrite, RefusesBadArguments) {
  for (const Arguments& arguments : {Arguments{{"address", "80"}, {"data", "00"}},
                                     {{"address", "-1"}, {"data", "00"}},
                                     {{"address", "x"}, {"data", "00"}},
                                     {{"address", "10"}, {"data", ""}},
                                     {{"address", "10"}, {"data", "1"}},
                                     {{"address", "10"}, {"data", "GG"}},
                                     {{"address", "79"}, {"data", "00 00"}},
                                     {}}) {
    DeviceFixture bench(kWritable);
    bench.GoOnline();
    bench.Begin("eeprom_write", arguments);
    EXPECT_EQ(bench.Last().reason, Reason::REASON_BAD_ARGUMENT);
    EXPECT_EQ(bench.Last().state, CommandState::kRejected);
  }
}

TEST(EepromWrite, SendsABusyOrMisunderstoodRequestAgain) {
  DeviceFixture bench(kWritable);
  bench.GoOnline();
  bench.Begin("eeprom_write", {{"address", "10"}, {"data", "A1"}});
  Backup(bench);
  bench.Give(WriteRequest(10, 0xA1), WriteBusy(10), false);
  Wait(bench);
  bench.Give(WriteRequest(10, 0xA1), All({.status = 0x40}), false);
  bench.Give(WriteRequest(10, 0xA1), All(), false);  // the CRC arrived damaged
  EXPECT_EQ(bench.output.non_volatile_writes, 0);
  bench.Give(WriteRequest(10, 0xA1), WriteRequest(10, 0xA1), false);
  EXPECT_EQ(bench.output.non_volatile_writes, 1);
  Wait(bench);
  bench.Give(ReadRequest(10), CellBusy(10), false);
  Wait(bench);
  bench.Give(ReadRequest(10), Cell(10, 0xA1), false);
  EXPECT_EQ(bench.Last().state, CommandState::kSucceeded);
}

TEST(EepromWrite, FailsWhenTheEncoderNeverTakesIt) {
  for (const bool busy : {true, false}) {
    DeviceFixture bench(kWritable);
    bench.GoOnline();
    bench.Begin("eeprom_write", {{"address", "10"}, {"data", "A1"}});
    Backup(bench);
    for (int i = 0; i < 100 && bench.FinalOutcomes() == 0; ++i) {
      Wait(bench);
      bench.Give(WriteRequest(10, 0xA1), busy ? WriteBusy(10) : All(), false);
    }
    EXPECT_EQ(bench.Last().state, CommandState::kFailed);
    EXPECT_EQ(bench.Last().reason, Reason::REASON_DEVICE_REFUSED);
    EXPECT_EQ(bench.output.non_volatile_writes, 0);
  }
}

// Spec 8.1: the reply "means only to receive a Data ID 6 but not to complete its writing process".
TEST(EepromWrite, AnAcceptedWriteOfABusyEepromIsNotCalledWritten) {
  DeviceFixture bench(kWritable);
  bench.GoOnline();
  bench.Begin("eeprom_write", {{"address", "10"}, {"data", "A1 A2 A3"}});
  Backup(bench);
  bench.Give(WriteRequest(10, 0xA1), WriteRequest(10, 0xA1), false);
  Wait(bench);
  bench.Give(ReadRequest(10), Cell(10, 0xA1), false);
  bench.Give(WriteRequest(11, 0xA2), WriteRequest(11, 0xA2), false);
  for (int i = 0; i < 100 && bench.FinalOutcomes() == 0; ++i) {
    Wait(bench);
    bench.Give(ReadRequest(11), CellBusy(11), false);
  }
  const Outcome& outcome = bench.Last();
  EXPECT_EQ(outcome.state, CommandState::kIndeterminate);
  EXPECT_FALSE(outcome.verified);
  EXPECT_NE(outcome.text.find("write to EEPROM 11 was accepted, but is not known to be done"), std::string::npos)
      << outcome.text;
  EXPECT_NE(outcome.text.find("busy"), std::string::npos);
  EXPECT_NE(outcome.text.find("10 holds its value, 11 begun, 12 not begun"), std::string::npos) << outcome.text;
  EXPECT_LE(outcome.text.size(), 200u);
  ASSERT_EQ(outcome.changes.size(), 2u);
  EXPECT_EQ(outcome.changes[0].key, "eeprom_0");
  EXPECT_EQ(outcome.changes[1].key, "finding");
  EXPECT_EQ(outcome.changes[1].before, "no_effect_seen") << "the bridge may find its effect later";
}

TEST(EepromWrite, FailsWhenTheCellReadsDifferently) {
  DeviceFixture bench(kWritable);
  bench.GoOnline();
  bench.Begin("eeprom_write", {{"address", "10"}, {"data", "A1 A2"}});
  Backup(bench);
  bench.Give(WriteRequest(10, 0xA1), WriteRequest(10, 0xA1), false);
  Wait(bench);
  bench.Give(ReadRequest(10), Cell(10, 0x0A), false);
  EXPECT_EQ(bench.Last().state, CommandState::kFailed);
  EXPECT_EQ(bench.Last().reason, Reason::REASON_READ_BACK_DIFFERS);
  EXPECT_TRUE(bench.IsIdle(false)) << "the next cell is not touched";
}

TEST(EepromWrite, NeverRepeatsAWriteWhoseReplyIsLost) {
  for (const bool written : {true, false}) {
    DeviceFixture bench(kWritable);
    bench.GoOnline();
    bench.Begin("eeprom_write", {{"address", "10"}, {"data", "A1"}});
    Backup(bench);
    bench.Give(WriteRequest(10, 0xA1), {}, false);
    EXPECT_EQ(bench.output.non_volatile_writes, 1) << "it may have been taken";
    bench.PassSilence();
    Wait(bench);
    bench.Give(ReadRequest(10), Cell(10, written ? 0xA1 : 0x0A), false);
    EXPECT_EQ(bench.Last().state, written ? CommandState::kSucceeded : CommandState::kFailed);
  }
}

TEST(EepromWrite, WritesNothingWithoutABackup) {
  DeviceFixture bench(kWritable);
  bench.GoOnline();
  bench.Begin("eeprom_write", {{"address", "10"}, {"data", "A1"}});
  for (int i = 0; i < 3; ++i) {
    bench.Give(ReadRequest(0), {}, false);
    bench.PassSilence();
  }
  EXPECT_EQ(bench.Last().state, CommandState::kFailed);
  EXPECT_NE(bench.Last().text.find("nothing was written"), std::string::npos);
}

TEST(EepromWrite, OnALostLinkItDependsOnTheWrite) {
  DeviceFixture before(kWritable);
  before.GoOnline();
  before.Begin("eeprom_write", {{"address", "10"}, {"data", "A1"}});
  EXPECT_EQ(before.output.outcomes.size(), 0u);
  before.LinkDown();
  EXPECT_EQ(before.Last().state, CommandState::kFailed);

  DeviceFixture bench(kWritable);
  bench.GoOnline();
  bench.Begin("eeprom_write", {{"address", "10"}, {"data", "A1"}});
  Backup(bench);
  bench.Start(false);
  EXPECT_FALSE(bench.device->Cancel({1, 2, 3}, bench.now));
  EXPECT_EQ(bench.output.non_volatile_writes, 0);
  bench.LinkDown();
  EXPECT_EQ(bench.Last().state, CommandState::kIndeterminate);
  EXPECT_EQ(bench.output.non_volatile_writes, 1) << "it may have been taken";
}

TEST(EepromWrite, IsIndeterminateWhenTheCellCannotBeReadBack) {
  DeviceFixture bench(kWritable);
  bench.GoOnline();
  bench.Begin("eeprom_write", {{"address", "10"}, {"data", "A1"}});
  Backup(bench);
  bench.Give(WriteRequest(10, 0xA1), WriteRequest(10, 0xA1), false);
  Wait(bench);
  for (int i = 0; i < 3; ++i) {
    bench.Give(ReadRequest(10), {}, false);
    bench.PassSilence();
  }
  EXPECT_EQ(bench.Last().state, CommandState::kIndeterminate);
}

TEST(EepromRead, ShowsTwentyCellsToAChange) {
  DeviceFixture bench;
  bench.GoOnline();
  bench.Begin("eeprom_backup");
  Backup(bench);
  EXPECT_EQ(bench.Last().state, CommandState::kSucceeded);
  ASSERT_EQ(bench.Last().changes.size(), 4u);
  EXPECT_EQ(bench.Last().changes[1].key, "eeprom_20");
  EXPECT_EQ(bench.Last().changes[1].after, "14 15 16 17 18 19 1A 1B 1C 1D 1E 1F 20 21 22 23 24 25 26 27");
  bench.Begin("eeprom_read", {{"address", "72"}, {"count", "2"}});
  bench.Give(ReadRequest(72), Cell(72, 0xA1), false);
  bench.Give(ReadRequest(73), CellBusy(73), false);
  Wait(bench);
  bench.Give(ReadRequest(73), Cell(73, 0x05), false);
  ASSERT_EQ(bench.Last().changes.size(), 1u);
  EXPECT_EQ(bench.Last().changes[0].key, "eeprom_72");
  EXPECT_EQ(bench.Last().changes[0].after, "A1 05");
}

TEST(EepromRead, SaysWhetherAWriteTookEffect) {
  for (const char* data : {"A105", "A1 05", "a106"}) {
    DeviceFixture bench;
    bench.GoOnline();
    bench.Begin("eeprom_read", {{"after", std::string("eeprom_write address=72 data=") + data}});
    bench.Give(ReadRequest(72), Cell(72, 0xA1), false);
    bench.Give(ReadRequest(73), Cell(73, 0x05), false);
    EXPECT_EQ(bench.Last().changes.back().key, "finding");
    EXPECT_EQ(bench.Last().changes.back().after, std::string(data) == "a106" ? "no_effect_seen" : "reads_as_after");
  }
}

TEST(EepromRead, EndsWhenTheCellStaysBusyOrUnread) {
  DeviceFixture bench;
  bench.GoOnline();
  bench.Begin("eeprom_read", {{"address", "0"}});
  for (int i = 0; i < 100 && bench.FinalOutcomes() == 0; ++i) {
    Wait(bench);
    bench.Give(ReadRequest(0), CellBusy(0), false);
  }
  EXPECT_EQ(bench.Last().state, CommandState::kFailed);
  EXPECT_EQ(bench.Last().reason, command_status_t::REASON_NO_REPLY) << "the bridge looks again";
  EXPECT_NE(bench.Last().text.find("busy"), std::string::npos);
}

TEST(EepromRead, RefusesBadArguments) {
  for (const Arguments& arguments : {Arguments{},
                                     {{"address", "80"}},
                                     {{"address", "79"}, {"count", "2"}},
                                     {{"address", "0"}, {"count", "0"}},
                                     {{"after", "clear_errors"}},
                                     {{"after", "eeprom_write address=79 data=A105"}},
                                     {{"after", ""}}}) {
    DeviceFixture bench;
    bench.GoOnline();
    bench.Begin("eeprom_read", arguments);
    EXPECT_EQ(bench.Last().reason, Reason::REASON_BAD_ARGUMENT);
  }
}

}  // namespace
}  // namespace axlecast::tformat
