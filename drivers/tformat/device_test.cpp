#include "drivers/tformat/family.h"

#include "drivers/tformat/device_test_support.h"

namespace axlecast::tformat {
namespace {

TEST(TFormatDevice, TransmitsNothingWhileTheLinkIsDown) {
  DeviceFixture bench;
  EXPECT_EQ(bench.IdleUntil(true), kNever);
  bench.LinkUp();
  bench.LinkDown();
  EXPECT_TRUE(bench.IsIdle());
}

TEST(TFormatDevice, BeginsWithSilenceAndId3WhateverThePlan) {
  DeviceFixture bench("{model: ts5669n127, plan: id0}");
  bench.LinkUp();
  EXPECT_TRUE(bench.IsSilence());
  bench.PassSilence();
  EXPECT_EQ(bench.Offered(false), kId3);
}

// Spec 5.4: the standby lasts 1 s with an external battery, 1.5 s without; note 2: the line may be undefined meanwhile.
TEST(TFormatDevice, IsStartingWhileTheEncoderStandsBy) {
  for (const auto& [keys, standby] :
       {std::pair{"{model: ts5669n127}", kSecond}, {"{model: ts5669n127, battery: false}", 1'500 * kMillisecond}}) {
    DeviceFixture bench(keys);
    bench.LinkUp();
    const MonoNs up = bench.now;
    const std::vector<ByteList> heard = {{}, {0x55}, {0x1A, 0x00, 1, 2, 3, 4, 5, 6, 7, 8, 9}, {}};
    for (std::size_t i = 0; bench.now - up < standby - 50 * kMillisecond; ++i) {
      if (i % 4 == 3) bench.Stray({0x00, 0xFF});
      bench.PassSilence();
      bench.Give(kId3, heard[i % 4]);
      bench.now += 40 * kMillisecond;
    }
    EXPECT_EQ(bench.output.AllErrors(), 0) << keys;
    EXPECT_GT(bench.output.starting, 10);
    bench.now = up + standby + kMillisecond;
    bench.PassSilence();
    bench.Give(kId3, {});
    EXPECT_EQ(bench.output.errors[ErrorKind::kTimeout], 1) << keys;
  }
}

TEST(TFormatDevice, AsksAnEncoderThatDoesNotAnswerEvery50Ms) {
  DeviceFixture bench;
  bench.LinkUp();
  for (int i = 0; i < 2; ++i) {
    bench.PassSilence();
    bench.Give(kId3, {}, false);
  }
  bench.PassSilence();
  const MonoNs next = bench.IdleUntil();
  EXPECT_GT(next, bench.now);
  EXPECT_LE(next - bench.now, 50 * kMillisecond);
  bench.now = next;
  EXPECT_EQ(bench.Offered(false), kId3);
}

TEST(TFormatDevice, ReadsId3InEverySlot) {
  DeviceFixture bench;
  bench.GoOnline();
  for (int i = 0; i < 5; ++i) bench.Give(kId3, All({.single_turn = 1000, .turns = 65535}));
  EXPECT_TRUE(bench.IsIdle(false));
  const Sample& sample = bench.output.samples.back();
  EXPECT_EQ(sample.counts, 1000);
  EXPECT_EQ(sample.turns, 65535);
  EXPECT_TRUE(sample.has_turns);
  EXPECT_TRUE(sample.turns_trusted);
  EXPECT_FALSE(sample.error);
  EXPECT_EQ(bench.output.samples.size(), 7u);
  EXPECT_EQ(bench.output.AllErrors(), 0);
}

TEST(TFormatDevice, BoundsTheSamplingInstantByTheWire) {
  DeviceFixture bench;
  bench.GoOnline();
  const MonoNs start = bench.now;
  bench.Give(kId3, All());
  // The request takes 4 us; the reply had 11 bytes of 4 us when its last read returned after 60 us. A rate that is 3 %
  // too fast is allowed for.
  EXPECT_EQ(bench.output.samples.back().at, (Interval{start + 3'880, start + 60'000 - 11 * 3'880}));
}

TEST(TFormatDevice, ASimulatedWireMayBeFasterThanARealOne) {
  DeviceFixture bench("{model: ts5669n127}", false, true);
  bench.GoOnline();
  const MonoNs start = bench.now;
  bench.Give(kId3, All());
  EXPECT_EQ(bench.output.samples.back().at, (Interval{start, start + 55 * kMicrosecond}));
}

// The reply to an earlier ID 3 may still come late.
struct Id3Held final : PendingReplies {
  [[nodiscard]] MonoNs FreeAt(const Exchange& exchange, MonoNs now) const override {
    const Bytes request = exchange.request;
    return ByteList(request.begin(), request.end()) == kId3 ? kNever : now;
  }
};

// No time is lost: ID 0 has a reply of another shape.
TEST(TFormatDevice, AsksForAnotherDataIdWhileAReplyMayStillCome) {
  DeviceFixture bench;
  bench.GoOnline();
  ASSERT_EQ(bench.Offered(), kId3);
  const Id3Held held;
  const Step step = bench.device->Next({.now = bench.now, .poll_due = true, .pending = &held});
  ASSERT_TRUE(std::holds_alternative<Exchange>(step.action)) << "it waits";
  const Bytes request = std::get<Exchange>(step.action).request;
  EXPECT_EQ(ByteList(request.begin(), request.end()), kId0);
}

// Between two slots, a replacement would be sent again and again until ID 3 is free: 812 exchanges per second at 100 Hz.
TEST(TFormatDevice, ReplacesARequestOnlyInASlot) {
  DeviceFixture bench;
  bench.GoOnline();
  bench.Give(kId3, {});  // is repeated at once
  if (bench.IsSilence()) bench.PassSilence();
  const Id3Held held;
  const Step step = bench.device->Next({.now = bench.now, .poll_due = false, .pending = &held});
  ASSERT_TRUE(std::holds_alternative<Exchange>(step.action));
  const Bytes request = std::get<Exchange>(step.action).request;
  EXPECT_EQ(ByteList(request.begin(), request.end()), kId3) << "which the schedule holds until it is free";
}

TEST(TFormatDevice, ReadsId0FastAndId3EveryNth) {
  DeviceFixture bench("{model: ts5669n127, plan: id0, id3_every: 4}");
  bench.GoOnline();
  bench.requests.clear();
  for (int i = 0; i < 8; ++i) {
    const ByteList request = bench.Start();
    bench.Finish(request == kId3 ? All() : Short(kId0));
  }
  std::vector<ByteList> order;
  for (const auto& request : bench.requests) order.push_back(request.second);
  EXPECT_EQ(order, (std::vector<ByteList>{kId0, kId0, kId0, kId3, kId0, kId0, kId0, kId3}));
  EXPECT_TRUE(bench.output.samples.back().has_turns);
  EXPECT_FALSE(bench.output.samples[bench.output.samples.size() - 2].has_turns);
}

// Spec 6.3.2: "When the error occurs in bit of ea1, request Data ID 3 and confirm the content of ALMC".
TEST(TFormatDevice, AsksId3AtOnceWhenTheStatusFieldShowsAnError) {
  for (const std::uint8_t status : {std::uint8_t{0x10}, std::uint8_t{0x20}}) {
    DeviceFixture bench("{model: ts5669n127, plan: id0, id3_every: 100}");
    bench.GoOnline();
    bench.Give(kId0, Short(kId0, 42405, status));
    EXPECT_EQ(bench.output.samples.back().error, status == 0x10);
    const auto alarm = static_cast<std::uint8_t>(status == 0x10 ? 0x04 : 0x80);
    bench.Give(kId3, All({.alarms = alarm, .status = status}), false);
    bench.Give(kId3, All({.alarms = alarm, .status = status}), false);  // a second one confirms it
    EXPECT_TRUE(bench.output.Present(status == 0x10 ? "counting_error" : "battery_alarm"));
    EXPECT_TRUE(bench.IsIdle(false)) << "known by now: no more need for ID 3";
    bench.Give(kId0, Short(kId0, 42405, status));
    EXPECT_TRUE(bench.IsIdle(false));
  }
}

struct Fault {
  const char* name;
  ByteList reply;  // to ID 3
  ErrorKind kind;
  bool silence;
};

ByteList WithoutLast(ByteList bytes) {
  bytes.pop_back();
  return bytes;
}

ByteList Flipped(ByteList bytes, std::size_t at) {
  bytes.at(at) = static_cast<std::uint8_t>(bytes.at(at) ^ 0x01);
  return bytes;
}

class EachFault : public testing::TestWithParam<Fault> {};

TEST_P(EachFault, IsCountedByKindAndAskedAgainOnceAtOnce) {
  DeviceFixture bench;
  bench.GoOnline();
  const std::size_t samples = bench.output.samples.size();
  const Fault& fault = GetParam();
  bench.Give(kId3, fault.reply);
  EXPECT_EQ(bench.output.errors[fault.kind], 1) << fault.name;
  EXPECT_EQ(bench.output.AllErrors(), 1);
  EXPECT_EQ(bench.output.samples.size(), samples);
  EXPECT_EQ(bench.IsSilence(), fault.silence);
  if (fault.silence) bench.PassSilence();
  bench.Give(kId3, fault.reply, false);
  if (fault.silence) bench.PassSilence();
  EXPECT_TRUE(bench.IsIdle(false)) << "the second repetition waits";
  bench.Give(kId3, All());
  EXPECT_EQ(bench.output.samples.size(), samples + 1);
}

INSTANTIATE_TEST_SUITE_P(
    Replies, EachFault,
    testing::Values(Fault{"nothing", {}, ErrorKind::kTimeout, true},
                    Fault{"short", WithoutLast(All()), ErrorKind::kShort, true},
                    Fault{"checksum", Flipped(All(), 3), ErrorKind::kChecksum, true},
                    Fault{"echo", Checked({0x02, 0, 1, 2, 0, 0x11, 3, 0, 0, 0}), ErrorKind::kWrongEcho, true},
                    Fault{"abs2", All({.single_turn = 0x20000}), ErrorKind::kRange, true},
                    Fault{"abm2", All({.turns = 0x10000}), ErrorKind::kRange, true},
                    Fault{"d74", All({.alarms = 0x10}), ErrorKind::kRange, true},
                    Fault{"information", All({.status = 0x01}), ErrorKind::kRange, true},
                    Fault{"parity", All({.status = 0x40}), ErrorKind::kCommunicationAlarm, false},
                    Fault{"delimiter", All({.status = 0x80}), ErrorKind::kCommunicationAlarm, false},
                    Fault{"enid", All({.encoder_id = 0x17}), ErrorKind::kWrongIdentity, false}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(TFormatDevice, SendsTheSameRequestAgainAfterACommunicationAlarm) {
  DeviceFixture bench("{model: ts5669n127, plan: id0, id3_every: 100}");
  bench.GoOnline();
  bench.Give(kId0, All({.status = 0x40}));  // the encoder answers with ID 3's data
  EXPECT_EQ(bench.output.errors[ErrorKind::kCommunicationAlarm], 1);
  EXPECT_TRUE(bench.output.Present("communication_alarm"));
  bench.Give(kId0, Short(kId0), false);
  EXPECT_FALSE(bench.output.Present("communication_alarm"));
}

TEST(TFormatDevice, ReadsNoPositionFromTheAnswerToAnAbnormalRequest) {
  DeviceFixture bench("{model: ts5669n127, plan: id0, id3_every: 100}");
  bench.GoOnline();
  const std::size_t samples = bench.output.samples.size();
  bench.Give(kId0, All());
  EXPECT_EQ(bench.output.errors[ErrorKind::kAbnormalReply], 1);
  EXPECT_EQ(bench.output.samples.size(), samples);
  EXPECT_EQ(bench.Offered(false), kId0);
}

TEST(TFormatDevice, TakesTheRestOfALongReplyForStrayBytes) {
  DeviceFixture bench("{model: ts5669n127, plan: id0, id3_every: 100}");
  bench.GoOnline();
  ByteList reply = Short(kId0);
  reply.push_back(0x00);
  bench.Give(kId0, reply);
  EXPECT_EQ(bench.output.errors[ErrorKind::kUnexpectedBytes], 1);
  EXPECT_TRUE(bench.IsSilence());
}

TEST(TFormatDevice, StaysSilentAfterStrayBytesUntilTheLineIsQuiet) {
  DeviceFixture bench("{model: ts5669n127, silence_us: 3000}");
  bench.GoOnline();
  bench.Stray({0x55});
  const Step step = bench.Next();
  EXPECT_EQ(std::get<WaitForIdleLine>(step.action).quiet, 3 * kMillisecond);
  bench.Stray({0x55});
  EXPECT_TRUE(bench.IsSilence());
  bench.PassSilence();
  EXPECT_EQ(bench.Offered(), kId3);
}

TEST(TFormatDevice, CallsADifferentEchoAnEchoError) {
  DeviceFixture bench("{model: ts5669n127}", true);
  bench.GoOnline();
  bench.Start();
  ByteList bytes = {0x1B};  // the medium hands over everything when the echo is not what was sent
  for (const std::uint8_t byte : All()) bytes.push_back(byte);
  const Event event{.kind = Event::Kind::kTimeout,
                    .sent = {bench.now, bench.now},
                    .received = {bench.now, bench.now},
                    .request = kId3,
                    .bytes = bytes};
  bench.device->On(event);
  EXPECT_EQ(bench.output.errors[ErrorKind::kWrongEcho], 1);
  EXPECT_TRUE(bench.IsSilence());
}

TEST(TFormatDevice, BeginsWithId3AgainAfterTheEncoderWasGone) {
  DeviceFixture bench("{model: ts5669n127, plan: id0, id3_every: 100}");
  bench.GoOnline();
  bench.Give(kId0, {});
  bench.PassSilence();
  bench.Give(kId0, {}, false);
  bench.PassSilence();
  EXPECT_EQ(bench.Offered(), kId3);
  EXPECT_EQ(bench.output.errors[ErrorKind::kTimeout], 2);
}

// A recorded sequence of events, handed to a fresh device, gives the same samples.
TEST(TFormatDevice, DecodesFromTheEventsAlone) {
  DeviceFixture bench(
      "{model: ts5669n127, plan: id0, id3_every: 3, identity: {eeprom_address: 72, bytes: \"A1\"}}");
  RecordingOutput again;
  const std::unique_ptr<Device> fresh = MakeDevice(bench.bus(), bench.config(), again);
  const auto both = [&](Event::Kind kind, MonoNs at, const ByteList& request, const ByteList& bytes) {
    const Event event{.kind = kind,
                      .sent = {at, at + 10},
                      .received = {at + 20'000, at + 60'000},
                      .request = request,
                      .bytes = bytes};
    bench.device->On(event);
    fresh->On(event);
    static_cast<void>(bench.Next());  // only one of them is polled for its step
  };
  both(Event::Kind::kLinkUp, 1, {}, {});
  both(Event::Kind::kSilent, 2, {}, {});
  both(Event::Kind::kReply, 1000, kId3, All());
  both(Event::Kind::kReply, 100'000, Checked({0xEA, 72}), Cell(72, 0xA1));
  both(Event::Kind::kReply, 200'000, kId3, All({.single_turn = 5, .alarms = 0x40, .status = 0x20}));
  both(Event::Kind::kReply, 300'000, kId0, Short(kId0, 6, 0x20));
  both(Event::Kind::kTimeout, 400'000, kId0, {0x02});
  both(Event::Kind::kReply, 500'000, kId3, All({.single_turn = 7, .alarms = 0x40, .status = 0x20}));
  ASSERT_EQ(bench.output.samples.size(), 3u);
  ASSERT_EQ(again.samples.size(), 3u);
  for (std::size_t i = 0; i < again.samples.size(); ++i) {
    EXPECT_EQ(again.samples[i].at, bench.output.samples[i].at);
    EXPECT_EQ(again.samples[i].counts, bench.output.samples[i].counts);
    EXPECT_EQ(again.samples[i].turns_trusted, bench.output.samples[i].turns_trusted);
    EXPECT_EQ(again.samples[i].device_status, bench.output.samples[i].device_status);
  }
  EXPECT_EQ(again.references_lost, 1);
  EXPECT_EQ(again.errors, bench.output.errors);
}

}  // namespace
}  // namespace axlecast::tformat
