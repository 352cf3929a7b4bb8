#include "drivers/runtime/bus/wire_log.h"

#include <gmock/gmock.h>

#include <memory>
#include <random>
#include <string>
#include <vector>

#include "drivers/runtime/bus/bus.h"
#include "tests/support/memory_sink.h"
#include "tests/support/polled_device.h"
#include "tests/support/recording_output.h"
#include "tests/support/scripted_link.h"

namespace axlecast {
namespace {

using ::testing::Each;
using ::testing::Ge;
using ::testing::SizeIs;

constexpr MonoNs kStart = 1'000 * kSecond;
const std::string kChannel = "WIRE/rs485-0";

// An event that owns its bytes.
struct Kept {
  Event::Kind kind;
  Interval sent;
  Interval received;
  std::vector<std::uint8_t> request;
  std::vector<std::uint8_t> bytes;
  friend bool operator==(const Kept&, const Kept&) = default;
};

Kept Keep(const Event& event) {
  return {event.kind,
          event.sent,
          event.received,
          {event.request.begin(), event.request.end()},
          {event.bytes.begin(), event.bytes.end()}};
}

class WireLogTest : public ::testing::Test {
 protected:
  WireLogTest() { time_.Update(kStart, 1'700'000'000'000'000); }

  std::vector<Kept> ReadBack() {
    std::vector<Kept> events;
    for (const wire_t& message : sink_.All<wire_t>(kChannel)) {
      reader_.Read(message, [&](const Event& event) { events.push_back(Keep(event)); });
    }
    return events;
  }

  Timebase time_;
  MemorySink sink_;
  WireLog log_{"rs485-0", Origin{.boot_id = 42}, time_, sink_, {}};
  WireReader reader_;
};

TEST_F(WireLogTest, EveryKindOfEventComesBackUnchanged) {
  const std::vector<std::uint8_t> request = {0x1A};
  const std::vector<std::uint8_t> bytes = {1, 2, 3};
  std::vector<Kept> expected;
  const auto record = [&](const Event& event) {
    log_.Record(event);
    expected.push_back(Keep(event));
  };
  const Interval sent = {kStart, kStart + 4'000};
  const Interval received = {kStart + 12'345, kStart + 56'789};
  record({.kind = Event::Kind::kLinkUp, .sent = {}, .received = {kStart, kStart}, .request = {}, .bytes = {}});
  record({.kind = Event::Kind::kReply, .sent = sent, .received = received, .request = request, .bytes = bytes});
  record({.kind = Event::Kind::kTimeout, .sent = sent, .received = received, .request = request, .bytes = bytes});
  record({.kind = Event::Kind::kTimeout, .sent = sent, .received = received, .request = request, .bytes = {}});
  record({.kind = Event::Kind::kUnexpectedBytes, .sent = {}, .received = received, .request = {}, .bytes = bytes});
  record({.kind = Event::Kind::kSilent, .sent = {}, .received = received, .request = {}, .bytes = {}});
  record({.kind = Event::Kind::kUnsolicited, .sent = {}, .received = received, .request = {}, .bytes = bytes});
  record({.kind = Event::Kind::kLinkDown, .sent = {}, .received = received, .request = {}, .bytes = {}});
  log_.Flush();
  EXPECT_EQ(ReadBack(), expected);
  EXPECT_EQ(reader_.unreadable(), 0);
}

TEST_F(WireLogTest, AMessageCarriesItsTimesAndItsBus) {
  log_.Record({.kind = Event::Kind::kSilent,
               .sent = {},
               .received = {kStart + 5 * kMillisecond, kStart + 6 * kMillisecond},
               .request = {},
               .bytes = {}});
  log_.Flush();
  const auto messages = sink_.All<wire_t>(kChannel);
  ASSERT_THAT(messages, SizeIs(1));
  EXPECT_EQ(messages[0].mono_ns, kStart + 5 * kMillisecond);
  EXPECT_EQ(messages[0].utime, 1'700'000'000'005'000);
  EXPECT_EQ(messages[0].boot_id, 42);
  EXPECT_EQ(messages[0].bus, "rs485-0");
  EXPECT_EQ(messages[0].kind, wire_t::KIND_SERIAL);
  EXPECT_EQ(messages[0].records[0].duration_ns, kMillisecond);
}

// ID 3 of T-format at the wire's rate: 1 byte out, 11 back, each 51 us.
TEST_F(WireLogTest, FlushesBefore1300Bytes) {
  class Sizes final : public MessageSink {
   public:
    void Publish(const std::string&, Bytes message) override { sizes.push_back(message.size()); }
    std::vector<std::size_t> sizes;
  } sizes;
  WireLog log("rs485-0", Origin{.boot_id = 42}, time_, sizes, {});
  const std::vector<std::uint8_t> request = {0x1A};
  const std::vector<std::uint8_t> reply(11, 0);
  for (int i = 0; i < 1'000; ++i) {
    const MonoNs at = kStart + i * 51 * kMicrosecond;
    log.Record(
        {.kind = Event::Kind::kReply, .sent = {at, at}, .received = {at, at}, .request = request, .bytes = reply});
  }
  ASSERT_THAT(sizes.sizes, Not(testing::IsEmpty()));
  EXPECT_THAT(sizes.sizes, Each(testing::Le(WireLog::kFlushBytes)));
  EXPECT_THAT(sizes.sizes, Each(Ge(WireLog::kFlushBytes - 44)));
}

TEST_F(WireLogTest, TheSmallestRecordsFitToo) {
  for (int i = 0; i < 500; ++i) {
    log_.Record(
        {.kind = Event::Kind::kSilent, .sent = {}, .received = {kStart, kStart}, .request = {}, .bytes = {}});
  }
  log_.Flush();
  EXPECT_THAT(ReadBack(), SizeIs(500));
}

TEST_F(WireLogTest, FlushesAfterTenMilliseconds) {
  const auto silent = [&](MonoNs at) {
    log_.Record({.kind = Event::Kind::kSilent, .sent = {}, .received = {at, at}, .request = {}, .bytes = {}});
  };
  EXPECT_EQ(log_.due(), kNever);
  silent(kStart);
  EXPECT_EQ(log_.due(), kStart + 10 * kMillisecond);
  silent(kStart + 9 * kMillisecond);
  log_.FlushIfDue(kStart + 10 * kMillisecond - 1);
  EXPECT_THAT(sink_.All<wire_t>(kChannel), SizeIs(0));
  log_.FlushIfDue(kStart + 10 * kMillisecond);
  EXPECT_THAT(sink_.All<wire_t>(kChannel), SizeIs(1));
  silent(kStart + 20 * kMillisecond);
  silent(kStart + 31 * kMillisecond);  // the bus was too busy to flush
  EXPECT_THAT(sink_.All<wire_t>(kChannel), SizeIs(2));
  EXPECT_EQ(sink_.All<wire_t>(kChannel)[1].seq, 1);
}

TEST_F(WireLogTest, WhatCannotBeWrittenIsCounted) {
  log_.Record({.kind = Event::Kind::kSilent,
               .sent = {},
               .received = {kStart, kStart + 3 * kSecond},  // beyond 32 bits of nanoseconds
               .request = {},
               .bytes = {}});
  log_.Record({.kind = Event::Kind::kSilent, .sent = {}, .received = {kStart, kStart}, .request = {}, .bytes = {}});
  log_.Flush();
  const auto messages = sink_.All<wire_t>(kChannel);
  ASSERT_THAT(messages, SizeIs(1));
  EXPECT_EQ(messages[0].n, 1);
  EXPECT_EQ(messages[0].dropped, 1);
}

TEST_F(WireLogTest, TheReaderCountsStrangeRecords) {
  wire_t message{};
  wire_record_t record{};
  record.direction = wire_record_t::DIRECTION_TRANSMIT;
  message.records.push_back(record);
  record.direction = 77;
  message.records.push_back(record);
  record.direction = wire_record_t::DIRECTION_TRANSMIT;
  message.records.push_back(record);
  int events = 0;
  reader_.Read(message, [&](const Event&) { ++events; });
  EXPECT_EQ(events, 0);
  EXPECT_EQ(reader_.unreadable(), 3);
}

class Nobody final : public BusObserver {
 public:
  void OnLink(bool, std::string_view, MonoNs) override {}
};

// A run with everything that goes wrong, recorded, and decoded again by a fresh device.
TEST_F(WireLogTest, ARecordedRunDecodedAgainGivesTheSameReadings) {
  FakeClock clock(kStart);
  std::mt19937 random(5);
  std::uint16_t counts = 0;
  ScriptedLink link(clock, [&](Bytes request) -> std::vector<ScriptedLink::Burst> {
    auto reply = PolledDevice::Reply(request[0], request[1], counts++);
    const MonoNs after = static_cast<MonoNs>(random() % 200) * kMicrosecond;
    switch (random() % 12) {
      case 0:
        return {};
      case 1:
        reply[random() % 5] ^= 0x10;
        break;
      case 2:
        reply.pop_back();
        break;
      case 3:
        reply.push_back(0xEE);
        break;
      case 4:
        return {{after + PolledDevice::kTimeout, reply}};
      default:
        break;
    }
    return {{after, {reply.begin(), reply.begin() + 2}},
            {after + 20 * kMicrosecond, {reply.begin() + 2, reply.end()}}};
  });
  link.SetWriteTime(3 * kMicrosecond);
  link.LoseAt(kStart + kSecond);
  Nobody nobody;
  RecordingOutput live;
  PolledDevice device(1, live);
  Bus bus({.schedule = {.ticks = {.period = 400 * kMicrosecond}}}, link, clock, nobody, &log_);
  bus.Add(device);
  while (clock.Now() < kStart + 3 * kSecond) bus.RunOnce(kStart + 3 * kSecond);
  log_.Flush();
  ASSERT_GT(live.samples.size(), 2'000U);
  ASSERT_GT(live.errors.size(), 200U);

  RecordingOutput again;
  PolledDevice fresh(1, again);
  std::int64_t seq = 0;
  for (const wire_t& message : sink_.All<wire_t>(kChannel)) {
    EXPECT_EQ(message.seq, seq++);
    EXPECT_EQ(message.dropped, 0);
    reader_.Read(message, [&](const Event& event) { fresh.On(event); });
  }
  EXPECT_EQ(reader_.unreadable(), 0);
  EXPECT_EQ(again.errors, live.errors);
  EXPECT_EQ(fresh.told, device.told);
  ASSERT_EQ(again.samples.size(), live.samples.size());
  for (std::size_t i = 0; i < live.samples.size(); ++i) {
    EXPECT_EQ(again.samples[i].at, live.samples[i].at);
    EXPECT_EQ(again.samples[i].counts, live.samples[i].counts);
  }
}

TEST_F(WireLogTest, OfASecretOnlyAddressAndFunctionAreShown) {
  const std::vector<std::uint8_t> request = {3, 0x10, 0x70, 0x61};
  const std::vector<std::uint8_t> reply = {3, 0x10, 0x73};
  log_.Record({.kind = Event::Kind::kReply,
               .sent = {kStart, kStart + 1},
               .received = {kStart + 2, kStart + 3},
               .request = request,
               .bytes = reply,
               .secret = true});
  log_.Record({.kind = Event::Kind::kUnexpectedBytes,
               .sent = {},
               .received = {kStart + 4, kStart + 5},
               .request = {},
               .bytes = reply});
  log_.Flush();
  const auto messages = sink_.All<wire_t>(kChannel);
  ASSERT_THAT(messages, SizeIs(1));
  ASSERT_THAT(messages[0].records, SizeIs(3));
  EXPECT_EQ(messages[0].records[0].data, (std::vector<std::uint8_t>{3, 0x10, 0, 0}));
  EXPECT_EQ(messages[0].records[0].flags, wire_record_t::FLAG_REDACTED);
  EXPECT_EQ(messages[0].records[1].data, (std::vector<std::uint8_t>{3, 0x10, 0}));
  EXPECT_EQ(messages[0].records[1].flags, wire_record_t::FLAG_REDACTED);
  EXPECT_EQ(messages[0].records[2].data, reply);
  EXPECT_EQ(messages[0].records[2].flags, 0);
}

TEST_F(WireLogTest, OfBytesThatMayBeginAnywhereInASecretNothingIsShown) {
  const std::vector<std::uint8_t> bytes = {0x70, 0x61, 0x73};
  for (const Event::Kind kind : {Event::Kind::kUnexpectedBytes, Event::Kind::kTimeout}) {
    log_.Record({.kind = kind,
                 .sent = {kStart, kStart},
                 .received = {kStart, kStart},
                 .request = {},
                 .bytes = bytes,
                 .secret = true});
  }
  log_.Flush();
  const auto messages = sink_.All<wire_t>(kChannel);
  ASSERT_THAT(messages, SizeIs(1));
  for (const auto& record : messages[0].records) {
    EXPECT_THAT(record.data, testing::Each(0));
    EXPECT_EQ(record.flags & wire_record_t::FLAG_REDACTED, wire_record_t::FLAG_REDACTED);
  }
}

}  // namespace
}  // namespace axlecast
