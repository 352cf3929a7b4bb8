#include "drivers/saa_modbus/family.h"

#include "drivers/kit/simulation/shaft.h"
#include "drivers/saa_modbus/bus_test_support.h"

// The device and the runtime's bus against the simulated encoders, in virtual time.
namespace axlecast::saa_modbus {
namespace {

TEST(SaaModbusDevice, ReadsThePositionOverAndOver) {
  Machine machine("axis1: {bits: 16}", "axis1: {start_deg: 90}");
  machine.Run(kSecond);
  const Watch& output = machine.output();
  ASSERT_GT(output.samples.size(), 60U);
  EXPECT_EQ(output.samples.back().counts, 16'384);
  EXPECT_FALSE(output.samples.back().has_turns);
  EXPECT_TRUE(output.errors.empty());
  EXPECT_EQ(machine.State("short_gaps"), "0");
  EXPECT_EQ(machine.State("collisions"), "0");
  EXPECT_EQ(output.starting.size(), 1U);
}

// 5.1.7 (5) 1 and 2: one register up to 16 bits, two above.
TEST(SaaModbusDevice, AsksForAsManyRegistersAsThePositionNeeds) {
  for (const auto& [bits, points] : {std::pair{10, 1}, {16, 1}, {17, 2}, {26, 2}}) {
    Machine machine("axis1: {bits: " + std::to_string(bits) + "}", "axis1: {start_deg: 180}");
    machine.Run(100 * kMillisecond);
    EXPECT_EQ(machine.port->written().front()[5], points) << bits;
    ASSERT_FALSE(machine.output().samples.empty()) << bits;
    EXPECT_EQ(machine.output().samples.back().counts, std::int64_t{1} << (bits - 1)) << bits;
  }
}

// "The interval time between the beginning and the end of each frame is at least 3.5 bytes."
TEST(SaaModbusDevice, KeepsTheSilentIntervalAtEveryRate) {
  for (const std::int64_t baud : {2'400, 4'800, 9'600, 19'200, 57'600}) {
    Machine machine("axis1: {bits: 20, address: 1}, axis2: {bits: 12, address: 2}", "", baud);
    machine.Run(2 * kSecond);
    EXPECT_EQ(machine.State("short_gaps"), "0") << baud;
    EXPECT_GT(machine.output(0).samples.size(), 5U) << baud;
    EXPECT_GT(machine.output(1).samples.size(), 5U) << baud;
    EXPECT_TRUE(machine.output(0).errors.empty()) << baud;
  }
}

TEST(SaaModbusDevice, SharesTheBusOf32) {
  std::string devices;
  std::string simulate;
  for (int i = 1; i <= 32; ++i) {
    const std::string name = (i > 1 ? ", u" : "u") + std::to_string(i);
    devices += name + ": {bits: 16, address: " + std::to_string(i) + "}";
    simulate += name + ": {start_deg: " + std::to_string(i) + "}";
  }
  Machine machine(devices, simulate);
  machine.Run(3 * kSecond);
  for (int i = 1; i <= 32; ++i) {
    const Watch& output = machine.outputs["u" + std::to_string(i)];
    ASSERT_GE(output.samples.size(), 5U) << i;
    for (const Sample& sample : output.samples) EXPECT_EQ(sample.counts, 65'536 * i / 360) << i;
    EXPECT_TRUE(output.errors.empty()) << i;
  }
}

TEST(SaaModbusDevice, BoundsTheInstantOfThePosition) {
  Machine machine("axis1: {bits: 16}", "axis1: {speed_rpm: 60, reply_us: 0}");
  Shaft shaft;
  ASSERT_TRUE(shaft.SetSpeed("60", machine.clock.Now()));
  machine.Run(kSecond);
  for (const Sample& sample : machine.output().samples) {
    const auto at = [&](MonoNs instant) { return DegreesFromAngle(shaft.At(instant).angle); };
    const double degrees = static_cast<double>(sample.counts) * 360 / 65'536;
    EXPECT_GE(degrees, at(sample.at.first) - 0.01);
    EXPECT_LE(degrees, at(sample.at.last) + 0.01);
  }
}

TEST(SaaModbusDevice, ASilentEncoderIsATimeoutAndComesBack) {
  Machine machine;
  machine.Run(200 * kMillisecond);
  machine.Set("axis1", "power", "off");
  machine.Run(2 * kSecond);
  EXPECT_GT(machine.output().Count(ErrorKind::kTimeout), 2);
  const std::size_t before = machine.output().samples.size();
  EXPECT_EQ(machine.Do("zero").reason, 16) << "REASON_DEVICE_OFFLINE";
  machine.Set("axis1", "power", "on");
  machine.Run(kSecond);
  EXPECT_GT(machine.output().samples.size(), before);
}

TEST(SaaModbusDevice, ALostReplyIsAskedForOnceWithTheOtherNumberOfRegisters) {
  Machine machine("axis1: {bits: 16}", "", 19'200, 280 * kMillisecond);
  machine.Run(330 * kMillisecond);
  const std::size_t before = machine.port->written().size();
  machine.Set("axis1", "fault", "intermittent:1");
  machine.Run(70 * kMillisecond);
  machine.Set("axis1", "fault", "none");
  machine.Run(120 * kMillisecond);
  const auto& written = machine.port->written();
  ASSERT_GT(written.size(), before + 2);
  bool asked_for_two = false;
  for (std::size_t i = before; i < written.size(); ++i) asked_for_two = asked_for_two || written[i][5] == 2;
  EXPECT_TRUE(asked_for_two);
  EXPECT_EQ(machine.output().samples.back().counts, 0);
  machine.Run(500 * kMillisecond);
  EXPECT_EQ(machine.port->written().back()[5], 1) << "then as before";
}

// The trap: an adapter or encoder hands over its replies late, by every delay.
TEST(SaaModbusDevice, ALateReplyIsNeverAnotherReading) {
  for (const char* bits : {"16", "20"}) {
    for (int delay_ms = 0; delay_ms < 900; delay_ms += 13) {
      const std::string two = std::string("axis1: {bits: ") + bits + ", address: 1, timeout_us: 40000}," +
                              "axis2: {bits: " + bits + ", address: 2, timeout_us: 40000}";
      Machine machine(two, "axis1: {start_deg: 10}, axis2: {start_deg: 200}", 19'200, kSecond);
      machine.Run(1'200 * kMillisecond);
      machine.Set("axis1", "fault", "delayed:" + std::to_string(delay_ms));
      machine.Run(300 * kMillisecond);
      machine.Set("axis1", "motion", "move:100,3000");  // readings from before are recognised
      const MonoNs moved = machine.clock.Now() + 300 * kMillisecond;
      machine.Run(3 * kSecond);
      const std::int64_t turn = std::int64_t{1} << std::stoi(bits);
      for (const Sample& sample : machine.output(0).samples) {
        if (sample.at.first < moved) continue;
        EXPECT_NEAR(static_cast<double>(sample.counts), static_cast<double>(turn) * 100 / 360, 2)
            << bits << " bits, " << delay_ms << " ms";
      }
      for (const Sample& sample : machine.output(1).samples) {
        EXPECT_NEAR(static_cast<double>(sample.counts), static_cast<double>(turn) * 200 / 360, 2) << delay_ms;
      }
      EXPECT_FALSE(machine.output(1).samples.empty());
    }
  }
}

TEST(SaaModbusDevice, AnotherEncodersReplyIsAWrongEcho) {
  Machine machine("axis1: {bits: 16, address: 5}", "axis1: {address: 6}");
  machine.Run(200 * kMillisecond);
  EXPECT_TRUE(machine.output().samples.empty()) << "it is not asked";
  const ByteList reply = {0x06, 0x03, 0x02, 0x01, 0x7F, 0x4D, 0xF4};  // golden/replies.txt
  machine.device().On(
      {.kind = Event::Kind::kReply, .sent = {}, .received = {}, .request = ReadRequest(5, 1), .bytes = reply});
  EXPECT_TRUE(machine.output().samples.empty());
  EXPECT_EQ(machine.output().Count(ErrorKind::kWrongEcho), 1);
}

// The encoder is present, whatever its reply holds.
TEST(SaaModbusDevice, AnEncoderThatAnswersWithExceptionsIsNotGone) {
  Machine machine;
  machine.Run(200 * kMillisecond);
  const ByteList exception = {0x01, 0x83, 0x02, 0xC0, 0xF1};
  for (int i = 0; i < 5; ++i) {
    const MonoNs now = machine.clock.Now();
    machine.device().On({.kind = Event::Kind::kReply,
                         .sent = {now, now},
                         .received = {now, now},
                         .request = ReadRequest(1, 1),
                         .bytes = exception});
  }
  EXPECT_EQ(machine.output().Count(ErrorKind::kException), 5);
  EXPECT_EQ(machine.Do("read_position").state, CommandState::kSucceeded);
}

TEST(SaaModbusDevice, EachFaultOfTheLineIsCountedByItsKind) {
  const auto kinds = [](const char* fault) {
    Machine machine;
    machine.Run(50 * kMillisecond);
    machine.Set("axis1", "fault", fault);
    machine.Run(2 * kSecond);
    std::map<ErrorKind, int> count;
    for (const auto& error : machine.output().errors) ++count[error.first];
    const std::size_t during = machine.output().samples.size();
    machine.Set("axis1", "fault", "none");
    machine.Run(kSecond);
    EXPECT_GT(machine.output().samples.size(), during) << fault;
    for (const Sample& sample : machine.output().samples) EXPECT_EQ(sample.counts, 0) << fault;
    return count;
  };
  EXPECT_GT(kinds("off")[ErrorKind::kTimeout], 0);
  EXPECT_GT(kinds("short:1")[ErrorKind::kShort], 0);
  EXPECT_GT(kinds("bit_flip:0.01")[ErrorKind::kChecksum], 0);
  EXPECT_GT(kinds("garbage").size(), 0U);
  EXPECT_GT(kinds("request_flip:0.01")[ErrorKind::kTimeout], 0);
  EXPECT_GT(kinds("echo").size(), 0U);
  EXPECT_EQ(kinds("slow:10000").size(), 0U);
}

TEST(SaaModbusDevice, OneDeviceOfABusCountsStrayBytes) {
  Machine machine("axis1: {bits: 16, address: 1}, axis2: {bits: 16, address: 2}");
  machine.Run(100 * kMillisecond);
  machine.Set("axis2", "fault", "delayed:100");
  machine.Run(kSecond);
  EXPECT_GT(machine.output(0).Count(ErrorKind::kUnexpectedBytes), 0);
  EXPECT_EQ(machine.output(1).Count(ErrorKind::kUnexpectedBytes), 0);
}

TEST(SaaModbusDevice, ATwoPointReadingThatIsRefusedCostsOnlyTime) {
  Machine machine("axis1: {bits: 14}", "axis1: {two_points: ignored, start_deg: 90}", 19'200, 300 * kMillisecond);
  machine.Run(400 * kMillisecond);
  machine.Set("axis1", "fault", "intermittent:1");
  machine.Run(60 * kMillisecond);
  machine.Set("axis1", "fault", "none");
  const std::size_t before = machine.output().samples.size();
  machine.Run(kSecond);
  EXPECT_GT(machine.output().samples.size(), before + 10);
  EXPECT_EQ(machine.output().samples.back().counts, 4'096);
}

TEST(SaaModbusDevice, GoesOnAfterTheLinkWasLost) {
  Machine machine;
  machine.Run(100 * kMillisecond);
  machine.port->Unplug();
  machine.Run(kSecond);
  machine.port->Plug();
  ASSERT_TRUE(machine.RunUntil([&] { return machine.output().starting.size() == 2; }));
  EXPECT_EQ(machine.Do("zero").reason, 16) << "REASON_DEVICE_OFFLINE: it may be another encoder";
  const std::size_t before = machine.output().samples.size();
  machine.Run(kSecond);
  EXPECT_GT(machine.output().samples.size(), before);
}

// An adapter may hold a reply back for longer than the port was closed.
TEST(SaaModbusDevice, AClosedLineMayBringLateRepliesAllTheSame) {
  constexpr MonoNs kLate = 5 * kSecond;
  Machine machine("axis1: {bits: 20}", "", 19'200, kLate);
  machine.Run(kLate + 100 * kMillisecond);
  machine.Set("axis1", "power", "off");
  machine.Run(200 * kMillisecond);
  const std::size_t before = machine.output().samples.size();
  machine.port->Unplug();
  machine.Set("axis1", "power", "on");
  machine.Run(kSecond);
  machine.port->Plug();
  machine.Run(kSecond);
  EXPECT_EQ(machine.output().samples.size(), before);
  machine.Run(kLate);
  EXPECT_GT(machine.output().samples.size(), before);
}

// The rest of a damaged reply may still come.
TEST(SaaModbusDevice, ADamagedReplyIsFollowedBySilence) {
  Machine machine;
  machine.Run(100 * kMillisecond);
  const MonoNs now = machine.clock.Now();
  const ByteList damaged = {0x01, 0x03, 0x02, 0x01, 0x7E, 0xF8, 0x34};
  machine.device().On({.kind = Event::Kind::kReply,
                       .sent = {now, now},
                       .received = {now, now},
                       .request = ReadRequest(1, 1),
                       .bytes = damaged});
  EXPECT_EQ(machine.output().Count(ErrorKind::kChecksum), 1);
  EXPECT_TRUE(std::holds_alternative<WaitForIdleLine>(machine.device().Next({.now = now}).action));
}

// Between two slots, once.
TEST(SaaModbusDevice, AFailedReadingIsAskedForOnceMoreAtOnce) {
  Machine machine;
  machine.Run(100 * kMillisecond);
  Device& device = machine.device();
  const auto fail = [&] {
    const MonoNs now = machine.clock.Now();
    device.On({.kind = Event::Kind::kTimeout,
               .sent = {now, now},
               .received = {now, now},
               .request = ReadRequest(1, 1),
               .bytes = {}});
    EXPECT_TRUE(std::holds_alternative<WaitForIdleLine>(device.Next({.now = now}).action));
    device.On({.kind = Event::Kind::kSilent, .sent = {}, .received = {now, now}, .request = {}, .bytes = {}});
    return device.Next({.now = now + kSecond}).action;
  };
  EXPECT_TRUE(std::holds_alternative<Exchange>(fail()));
  EXPECT_TRUE(std::holds_alternative<Idle>(fail()));
}

}  // namespace
}  // namespace axlecast::saa_modbus
