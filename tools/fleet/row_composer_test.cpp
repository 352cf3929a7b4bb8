#include "tools/fleet/row_composer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <axlecast/bus_health_t.hpp>
#include <axlecast/command_body_t.hpp>
#include <axlecast/command_t.hpp>
#include <axlecast/motor_health_t.hpp>
#include <axlecast/recorder_health_t.hpp>
#include <axlecast/time_quality_t.hpp>
#include <axlecast/trip_log_t.hpp>
#include <limits>

#include "tools/fleet/position_chunk.h"
#include "tools/fleet/raw_records.h"
#include "tools/fleet/row_fixture.h"
#include "tools/log/log_fixture.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

TEST(RowComposer, PositionsBecomeChunksSecondsAndMinutes) {
  ComposerFixture log;
  for (std::int64_t i = 0; i < 625; ++i) log.Add("POSITION/axis1", PositionAt(i));  // 2.5 s
  const BatchRows rows = log.Take();
  ASSERT_THAT(rows.streams, SizeIs(1));
  EXPECT_EQ(rows.streams[0], (StreamKey{.device = "axis1",
                                        .boot_id = kBoot,
                                        .datum_epoch = 0,
                                        .counts_per_turn = 131'072,
                                        .unit = position_t::UNIT_MM,
                                        .unit_per_count = 5.0 / 131'072}));
  ASSERT_THAT(rows.chunks, SizeIs(3));
  EXPECT_EQ(rows.samples, 625);
  EXPECT_EQ(rows.chunks[1].seq0, 256);
  ASSERT_THAT(rows.seconds, SizeIs(3));
  EXPECT_EQ(rows.seconds[1].t, kT0 + 1'000'000);
  EXPECT_EQ(rows.seconds[1].summary.lo, 1'000 + 250 * 100);
  EXPECT_EQ(rows.seconds[1].summary.hi, 1'000 + 499 * 100);
  EXPECT_DOUBLE_EQ(rows.seconds[1].summary.mean.value(), 1'000 + 374.5 * 100);
  EXPECT_EQ(rows.seconds[2].summary.n, 125);
  ASSERT_THAT(rows.minutes, SizeIs(1));
  EXPECT_EQ(rows.minutes[0].t, kT0 - kT0 % 60'000'000);
  EXPECT_EQ(rows.minutes[0].summary.n, 625);
  EXPECT_EQ(rows.counts, (EventCounts{.stored = 625}));
  EXPECT_EQ(rows.first_utime, kT0);
  EXPECT_EQ(rows.last_utime, kT0 + 624 * 4'000);
  EXPECT_THAT(log.Take().chunks, IsEmpty());
}

TEST(RowComposer, ANewEpochBeginsAStream) {
  ComposerFixture log;
  for (std::int64_t i = 0; i < 6; ++i) {
    position_t position = PositionAt(i);
    position.datum_epoch = i < 2 || i > 3 ? 0 : 1;
    log.Add("POSITION/axis1", position);
  }
  const BatchRows rows = log.Take();
  EXPECT_THAT(rows.streams, SizeIs(2));
  ASSERT_THAT(rows.chunks, SizeIs(3));
  EXPECT_EQ(rows.chunks[1].stream, 1U);
  EXPECT_EQ(rows.chunks[2].stream, 0U);
  EXPECT_THAT(rows.seconds, SizeIs(2));
  EXPECT_THAT(rows.minutes, SizeIs(2));  // one of each stream
  EXPECT_EQ(rows.counts.stored, 6);
}

TEST(RowComposer, TheScaleIsUnknownIfTheMessageHasAnother) {
  ComposerFixture log;
  position_t position = PositionAt(0);
  position.counts_per_turn = 65'536;
  log.Add("POSITION/axis1", position);
  position = PositionAt(0);
  position.unit = position_t::UNIT_DEG;
  log.Add("POSITION/axis2", position).Add("POSITION/other", PositionAt(0));
  const BatchRows rows = log.Take();
  ASSERT_THAT(rows.streams, SizeIs(3));
  for (const StreamKey& stream : rows.streams) EXPECT_EQ(stream.unit_per_count, std::nullopt);
}

TEST(RowComposer, AMessageThatWasReceivedTwiceCountsOnce) {
  ComposerFixture log;
  for (const std::int64_t i : {0, 1, 3, 2, 3, 1, 4}) log.Add("POSITION/axis1", PositionAt(i));
  const BatchRows rows = log.Take();
  EXPECT_EQ(rows.counts, (EventCounts{.stored = 5, .repeated = 2}));
  EXPECT_EQ(rows.samples, 5);
}

TEST(RowComposer, BlocksReplacePositions) {
  LogFacts facts = PressFacts();
  facts.devices["axis1"].block = true;
  ComposerFixture log({}, facts);
  for (std::int64_t i = 0; i < 3; ++i) {
    auto block = MessageAt<position_block_t>(kT0 + i * 40'000, i);
    block.counts_per_turn = 131'072;
    block.unit = position_t::UNIT_MM;
    block.unit_per_count = 5.0 / 131'072;
    block.missed = 2;
    block.n = 40;
    for (std::int32_t k = 0; k < 40; ++k) {
      block.dt_ns.push_back(k * 1'000'500);
      block.time_uncertainty_ns.push_back(100);
      block.counts.push_back(k);
      block.flags.push_back(position_t::FLAG_VALID);
    }
    log.Add("POSITION_BLOCK/axis1", block).Add("POSITION/axis1", PositionAt(i));
  }
  const BatchRows rows = log.Take();
  ASSERT_THAT(rows.chunks, SizeIs(1));
  EXPECT_EQ(rows.counts, (EventCounts{.stored = 3, .excluded = 3}));
  const auto samples = DecodePositionChunk(rows.chunks[0], rows.streams[0]).value();
  ASSERT_THAT(samples, SizeIs(120));
  EXPECT_EQ(samples[1].utime, kT0 + 1'000);
  EXPECT_EQ(samples[2].utime, kT0 + 2'001);
  EXPECT_EQ(samples[45].utime, kT0 + 40'000 + 5'002);
  EXPECT_EQ(samples[45].seq, 1);
  EXPECT_EQ(samples[40].missed, 2);
  EXPECT_EQ(samples[41].missed, 0);
  EXPECT_EQ(rows.chunks[0].summary.missed, 6);
}

TEST(RowComposer, FullBlocksKeepNanoseconds) {
  LogFacts facts = PressFacts();
  facts.devices["axis1"].block = true;
  ComposerFixture log(Rules({{"", {.detail = Detail::kFull}}}), facts);
  auto block = MessageAt<position_block_t>(kT0, 5);
  block.counts_per_turn = 131'072;
  block.unit_per_count = 5.0 / 131'072;
  block.n = 2;
  block.dt_ns = {0, 1'000'777};
  block.time_uncertainty_ns = {10, 20};
  block.counts = {1, 2};
  block.flags = {1, 1};
  log.Add("POSITION_BLOCK/axis1", block);
  const BatchRows rows = log.Take();
  ASSERT_THAT(rows.chunks, SizeIs(1));
  const auto samples = DecodePositionChunk(rows.chunks[0], rows.streams[0]).value();
  EXPECT_EQ(samples.at(1).mono_ns, block.mono_ns + 1'000'777);
  EXPECT_EQ(samples[1].time_uncertainty_ns, 20);
  EXPECT_EQ(samples[1].seq, 5);
}

TEST(RowComposer, RollupsWithoutChunks) {
  ComposerFixture log(Rules({{"^POSITION/", {.detail = Detail::kRollup}}}));
  for (std::int64_t i = 0; i < 500; ++i) log.Add("POSITION/axis1", PositionAt(i));
  const BatchRows rows = log.Take();
  EXPECT_THAT(rows.chunks, IsEmpty());
  EXPECT_THAT(rows.seconds, SizeIs(2));
  EXPECT_EQ(rows.counts, (EventCounts{.rolled_up = 500}));
}

TEST(RowComposer, ADeadbandIsCountedAndRolledUpInFull) {
  ComposerFixture log(Rules({{"^POSITION/", {.detail = Detail::kDeadband, .deadband = 1}}}));
  for (std::int64_t i = 0; i < 500; ++i) log.Add("POSITION/axis1", PositionAt(i));  // 26,215 counts are 1 mm
  const BatchRows rows = log.Take();
  ASSERT_THAT(rows.chunks, SizeIs(1));
  EXPECT_EQ(rows.samples, 3);  // 0, 263, 499
  EXPECT_EQ(rows.counts, (EventCounts{.stored = 3, .rolled_up = 497}));
  EXPECT_EQ(rows.seconds.at(0).summary.n + rows.seconds.at(1).summary.n, 500);
}

TEST(RowComposer, AlarmsOnceUntilTheyClear) {
  ComposerFixture log;
  for (std::int64_t i = 0; i < 5; ++i) log.Add("ALARM/axis1", AlarmsAt(kT0 + i * 1'000'000, i, {Alarm(7, kT0)}));
  log.Add("ALARM/axis1", AlarmsAt(kT0 + 5'000'000, 5, {}));
  const BatchRows rows = log.Take();
  ASSERT_THAT(rows.alarms, SizeIs(2));
  EXPECT_EQ(rows.alarms[1].change, AlarmChange::kCleared);
  EXPECT_EQ(rows.alarms[1].event, 5);
  EXPECT_EQ(rows.counts, (EventCounts{.stored = 2, .repeated = 4}));
}

// A composer that continues gives what one composer without a restart would have given.
TEST(RowComposer, PrimedItContinues) {
  ComposerFixture second;
  second.Prime("ALARM/axis1", AlarmsAt(kT0, 0, {Alarm(7, kT0)}))
      .Prime("POSITION/axis1", PositionAt(0))
      .Prime("DEVICE/axis1", MessageAt<device_info_t>(kT0, 0));
  second.Add("ALARM/axis1", AlarmsAt(kT0 + 10, 1, {Alarm(7, kT0)}))
      .Add("POSITION/axis1", PositionAt(0))
      .Add("DEVICE/axis1", MessageAt<device_info_t>(kT0 + 1'000'000, 1))
      .Add("ALARM/axis1", AlarmsAt(kT0 + 20, 2, {}));
  const BatchRows rows = second.Take();
  EXPECT_EQ(rows.counts, (EventCounts{.stored = 1, .repeated = 3}));
  ASSERT_THAT(rows.alarms, SizeIs(1));
  EXPECT_EQ(rows.alarms[0].change, AlarmChange::kCleared);
  EXPECT_THAT(rows.chunks, IsEmpty());
  EXPECT_THAT(rows.devices, IsEmpty());
}

command_status_t StatusAt(std::int64_t seq, std::int8_t state, bool is_final, std::int8_t finding = 0) {
  auto status = MessageAt<command_status_t>(kT0 + seq * 1'000, seq);
  status.id[0] = 0xAB;
  status.device = "axis1";
  status.operation = "zero";
  status.state = state;
  status.is_final = is_final ? 1 : 0;
  status.finding = finding;
  status.reason_code = is_final ? command_status_t::REASON_NO_REPLY : 0;
  status.text = "no reply within 100 ms";
  return status;
}

TEST(RowComposer, OutcomesAndFindingsOnce) {
  using S = command_status_t;
  ComposerFixture log;
  log.Add("COMMAND_STATUS", StatusAt(0, S::STATE_ACCEPTED, false))
      .Add("COMMAND_STATUS", StatusAt(1, S::STATE_INDETERMINATE, true))
      .Add("COMMAND_STATUS", StatusAt(2, S::STATE_INDETERMINATE, true))
      .Add("COMMAND_STATUS", StatusAt(3, S::STATE_INDETERMINATE, true, S::FINDING_EFFECT_SEEN))
      .Add("COMMAND_STATUS", StatusAt(4, S::STATE_INDETERMINATE, true, S::FINDING_EFFECT_SEEN));
  const BatchRows rows = log.Take();
  ASSERT_THAT(rows.commands, SizeIs(2));
  EXPECT_EQ(rows.commands[0].state, "indeterminate");
  EXPECT_EQ(rows.commands[0].finding, "");
  EXPECT_EQ(rows.commands[0].reason, "no_reply");
  EXPECT_EQ(rows.commands[0].id[0], 0xAB);
  EXPECT_EQ(rows.commands[1].finding, "effect_seen");
  EXPECT_EQ(rows.commands[1].event, 3);
  EXPECT_EQ(rows.counts, (EventCounts{.stored = 2, .repeated = 2, .excluded = 1}));
}

TEST(RowComposer, CommandsWithTheirSender) {
  command_body_t body{};
  body.id[15] = 1;
  body.device = "axis1";
  body.operation = "zero";
  body.reason = "new battery";
  body.key_id = 0xBEEF;
  auto command = MessageAt<command_t>(kT0, 0);
  command.body = Encoded(body);
  command.body_size = static_cast<std::int16_t>(command.body.size());
  auto bad = command;
  bad.body.pop_back();
  --bad.body_size;
  ComposerFixture log;
  log.Add("COMMAND", command).Add("COMMAND", command).Add("COMMAND", bad);
  body.mode = command_body_t::MODE_QUERY;
  command.body = Encoded(body);
  log.Add("COMMAND", command);
  const BatchRows rows = log.Take();
  ASSERT_THAT(rows.commands, SizeIs(1));
  EXPECT_EQ(rows.commands[0].state, "issued");
  EXPECT_EQ(rows.commands[0].issued_by, "000000000000beef");
  EXPECT_EQ(rows.commands[0].reason, "new battery");
  EXPECT_EQ(rows.counts, (EventCounts{.stored = 1, .repeated = 1, .excluded = 1, .odd = 1}));
}

TEST(RowComposer, ATripThatIsSentAgainOrMovedDownIsOne) {
  ComposerFixture log;
  auto trip = MessageAt<trip_log_t>(kT0, 0);
  trip.log_index = 1;
  trip.trip_count = 4;
  trip.samples[1][19] = 12.5F;
  log.Add("TRIP/motor1", trip);
  trip.seq = 1;
  trip.log_index = 2;
  trip.utime += 60'000'000;
  log.Add("TRIP/motor1", trip);
  trip.trip_count = 5;
  log.Add("TRIP/motor1", trip);
  const BatchRows rows = log.Take();
  ASSERT_THAT(rows.trips, SizeIs(2));
  EXPECT_NE(rows.trips[0].identity, rows.trips[1].identity);
  EXPECT_THAT(rows.trips[0].message, HasSubstr("12.5"));
  EXPECT_EQ(rows.counts, (EventCounts{.stored = 2, .repeated = 1}));
}

TEST(RowComposer, HealthEachTenSecondsAndAtOnceWhenTheStateChanges) {
  ComposerFixture log;
  std::vector<std::int64_t> stored;
  for (std::int64_t i = 0; i < 30; ++i) {
    auto info = MessageAt<device_info_t>(kT0 + i * 1'000'000, i);
    info.state = i == 13 || i == 14 ? device_info_t::STATE_OFFLINE : device_info_t::STATE_ONLINE;
    info.good = i;
    info.errors[3] = 2 * i;
    info.nv_writes = 9;
    log.Add("DEVICE/axis1", info);
  }
  const BatchRows rows = log.Take();
  for (const DeviceHealthRow& row : rows.devices) stored.push_back(row.seq);
  EXPECT_THAT(stored, testing::ElementsAre(0, 10, 13, 15, 20));
  EXPECT_EQ(rows.devices[1].event, 10);
  EXPECT_EQ(rows.devices[1].errors[3], 20);
  EXPECT_EQ(rows.devices[1].nv_writes, 9);
  EXPECT_EQ(rows.counts, (EventCounts{.stored = 5, .repeated = 25}));
}

TEST(RowComposer, HealthOfEveryKind) {
  ComposerFixture log;
  auto bus = MessageAt<bus_health_t>(kT0, 0);
  bus.rate_hz = 250;
  bus.utilisation = std::numeric_limits<float>::quiet_NaN();
  auto recorder = MessageAt<recorder_health_t>(kT0, 0);
  recorder.lost = 3;
  auto motor = MessageAt<motor_health_t>(kT0, 0);
  motor.voltage_v = 230;
  motor.current_a = std::numeric_limits<float>::quiet_NaN();
  auto clock = MessageAt<time_quality_t>(kT0, 0);
  clock.half_width_ns = 1'500;
  log.Add("BUS/line1", bus).Add("RECORDER/all", recorder).Add("MOTOR/motor1", motor).Add("TIME/host1", clock);
  const BatchRows rows = log.Take();
  EXPECT_EQ(rows.buses.at(0).bus, "line1");
  EXPECT_EQ(rows.buses[0].rate_hz, 250);
  EXPECT_EQ(rows.buses[0].utilisation, std::nullopt);
  EXPECT_EQ(rows.recorders.at(0).lost, 3);
  EXPECT_EQ(rows.motors.at(0).voltage_v, 230);
  EXPECT_EQ(rows.motors[0].current_a, std::nullopt);
  EXPECT_EQ(rows.clocks.at(0).host, "host1");
  EXPECT_EQ(rows.clocks[0].half_width_ns, 1'500);
  EXPECT_EQ(rows.counts.stored, 4);
}

TEST(RowComposer, OddMessagesWithTheirCause) {
  ComposerFixture log;
  position_t late = PositionAt(0);
  late.utime = kThisYear.end;
  position_t other = PositionAt(1);
  other.machine_id = NameHash("press4");
  auto wrong_type = MessageAt<device_info_t>(kT0, 0);
  const auto cut = Encoded(PositionAt(2));
  log.Add("POSITION/axis1", late).Add("POSITION/axis1", other).Add("POSITION/axis1", wrong_type);
  log.AddBytes("POSITION/axis1", Bytes(cut).first(cut.size() - 1), kT0).AddBytes("ALARM/axis1", {});
  const BatchRows rows = log.Take();
  ASSERT_THAT(rows.odd, SizeIs(5));
  EXPECT_EQ(rows.odd[0].cause, kOddTime);
  EXPECT_EQ(rows.odd[0].utime, kThisYear.end);
  EXPECT_EQ(rows.odd[0].message, Encoded(late));
  EXPECT_EQ(rows.odd[1].cause, kOddMachine);
  EXPECT_EQ(rows.odd[1].event, 1);
  EXPECT_EQ(rows.odd[2].cause, kOddMalformed);
  EXPECT_EQ(rows.odd[3].cause, kOddMalformed);
  EXPECT_EQ(rows.odd[3].channel, "POSITION/axis1");
  EXPECT_EQ(rows.counts, (EventCounts{.odd = 5}));
  log.composer().SetRange({.first = 0, .end = INT64_MAX});
  log.Add("POSITION/axis1", late);
  EXPECT_EQ(log.Take().counts, (EventCounts{.stored = 1}));
}

TEST(RowComposer, ABlockThatReachesOutOfRangeIsOdd) {
  LogFacts facts = PressFacts();
  facts.devices["axis1"].block = true;
  ComposerFixture log({}, facts);
  auto block = MessageAt<position_block_t>(kThisYear.end - 1, 0);
  block.n = 2;
  block.dt_ns = {0, 1'000};
  block.time_uncertainty_ns = {0, 0};
  block.counts = {0, 0};
  block.flags = {0, 0};
  log.Add("POSITION_BLOCK/axis1", block);
  log.Add("POSITION_BLOCK/axis1", MessageAt<position_block_t>(kT0, 0));  // of no sample
  const BatchRows rows = log.Take();
  ASSERT_THAT(rows.odd, SizeIs(2));
  EXPECT_EQ(rows.odd[0].cause, kOddTime);
  EXPECT_EQ(rows.odd[1].cause, kOddMalformed);
}

TEST(RowComposer, RawRecordsComeBackByteForByte) {
  ComposerFixture log(Rules({{"^WIRE/", {.detail = Detail::kNone, .raw = true}},
                             {"^POSITION/axis1$", {.detail = Detail::kSamples, .raw = true}}}));
  RecordedLog expected;
  const auto bytes = Encoded(PositionAt(0));
  const std::string message(bytes.begin(), bytes.end());
  for (const std::string channel : {"WIRE/line1", "POSITION/axis1", "WIRE/line2"}) {
    expected.Add(kT0, channel, message);
    log.AddBytes(channel, bytes);
  }
  log.composer().EndStretch();
  log.AddBytes("POSITION/axis2", bytes).AddBytes("WIRE/line1", bytes);
  const BatchRows rows = log.Take();
  ASSERT_THAT(rows.raw, SizeIs(2));
  EXPECT_EQ(Text(DecodeRaw(rows.raw[0]).value()), Text(expected.bytes()));
  EXPECT_EQ(rows.raw[1].first_event, 4);
  EXPECT_EQ(rows.raw_events, 4);
  EXPECT_EQ(rows.counts, (EventCounts{.stored = 5}));
}

TEST(RowComposer, TimesOfRawRowsAreLimitedAndThoseOfTheirRecordsAreNot) {
  ComposerFixture log(Rules({{"^WIRE/", {.detail = Detail::kNone, .raw = true}}}));
  log.AddBytes("WIRE/line1", {}, INT64_MAX).AddBytes("WIRE/line1", {}, INT64_MIN);
  const BatchRows rows = log.Take();
  EXPECT_EQ(rows.raw.at(0).t0, kThisYear.end - 1);
  EXPECT_EQ(rows.raw[0].t1, kThisYear.end - 1);
  const auto records = DecodeRaw(rows.raw[0]).value();
  EXPECT_EQ(ParseEvent(records).value().utime, INT64_MAX);
}

TEST(RowComposer, TheHeadAndSealsOfALog) {
  ComposerFixture log;
  const std::string file = "machine: press3\n";
  log.AddBytes(std::string(kMachineChannel), AsBytes(file), kT0)
      .AddBytes(std::string(kSchemaChannel), AsBytes("x"))
      .AddBytes(std::string(kSealChannel), EncodeSeal({}))
      .AddBytes("NOTES", AsBytes("x"));
  const BatchRows rows = log.Take();
  ASSERT_THAT(rows.machine_files, SizeIs(1));
  EXPECT_EQ(rows.machine_files[0].text, file);
  EXPECT_EQ(rows.machine_files[0].first_seen, kT0);
  // sha256sum of the text
  EXPECT_EQ(rows.machine_files[0].sha256[0], 0x85);
  EXPECT_EQ(rows.machine_files[0].sha256[31], 0xaa);
  EXPECT_EQ(rows.counts, (EventCounts{.excluded = 1, .bookkeeping = 3}));
  EXPECT_EQ(rows.counts.Total(), log.events());
}

}  // namespace
}  // namespace axlecast
