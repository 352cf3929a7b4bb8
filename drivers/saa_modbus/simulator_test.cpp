// The simulator against the SAA manual 5.1.7: what it answers, what it does not, and its faults by name.
#include "drivers/saa_modbus/family.h"

#include <gmock/gmock.h>
#include <yaml-cpp/yaml.h>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"
#include "drivers/saa_modbus/settings.h"
#include "tests/support/golden_file.h"

namespace axlecast::saa_modbus {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

using ByteList = std::vector<std::uint8_t>;

constexpr MonoNs kStart = 100 * kSecond;

// A host on the line: sends a frame when the line has been quiet and collects what comes.
class Host {
 public:
  // The simulator of these devices; what is wrong with the mappings.
  std::string Make(const std::string& devices, const std::string& simulate) {
    ConfigErrors errors("machine.yaml");
    ConfigMap map(YAML::Load("{devices: {" + devices + "}, simulate: {" + simulate + "}}"), "bus", errors);
    bus_.link.line.baud = 19'200;
    for (auto& [name, keys] : map.Maps("devices")) {
      DeviceConfig device;
      device.name = name;
      device.settings = ParseSettings(keys, bus_);
      bus_.devices.push_back(std::move(device));
    }
    ConfigMap simulated = map.Map("simulate");
    simulator_ = saa_modbus_family().make_simulator(bus_, simulated);
    simulated.Done();
    return errors.Text();
  }
  void Encoder(const std::string& keys, const std::string& simulate = "") {
    ASSERT_EQ(Make("axis1: {" + keys + "}", "axis1: {" + simulate + "}"), "");
  }

  // Returns what the host receives within a second after it sent this.
  ByteList Ask(const std::string& hex) {
    now_ += kSecond;
    ByteList heard;
    const auto receive = [&heard](Bytes bytes) { heard.insert(heard.end(), bytes.begin(), bytes.end()); };
    simulator_->OnBytes(GoldenBytes(hex), now_, receive);
    for (const MonoNs end = now_ + kSecond - 1; simulator_->NextDue() <= end;) {
      now_ = std::max(now_, simulator_->NextDue());
      simulator_->OnDue(now_, receive);
      if (!heard.empty() && answered_ < kStart) answered_ = now_;
    }
    return heard;
  }
  std::string Value(const std::string& key, const std::string& device = "axis1") {
    for (const auto& [name, value] : simulator_->State(device, now_)) {
      if (name == key) return value;
    }
    return "absent";
  }
  void Set(const std::string& key, const std::string& value) {
    EXPECT_EQ(ErrorText(simulator_->Set("axis1", key, value, now_)), "");
  }

  BusConfig bus_;
  std::unique_ptr<Simulator> simulator_;
  MonoNs now_ = kStart;
  MonoNs answered_ = 0;  // first bytes received
};

class SimulatorTest : public testing::Test, protected Host {};

constexpr const char* kRead = "01 03 00 00 00 01 84 0A";
constexpr const char* kReadTwo = "01 03 00 00 00 02 C4 0B";

TEST_F(SimulatorTest, AnswersTheManualsRequestsAndNoOthers) {
  for (const GoldenRow& row : GoldenRows(__FILE__, "requests.txt", 2)) {
    Host fresh;
    const std::size_t at = row.columns[1].find("address=");
    fresh.Encoder("bits: 14, address: " +
                  std::to_string(at == std::string::npos ? 1 : std::stoi(row.columns[1].substr(at + 8))));
    EXPECT_EQ(fresh.Ask(row.columns[0]).empty(), row.columns[1] == "-") << row.where;
  }
}

// 5.1.7 (7): 383 at 14 bits; (5) 1 and 2.
TEST_F(SimulatorTest, ReadsAsInTheManual) {
  Encoder("bits: 14", "start_deg: 8.4265");
  EXPECT_EQ(Ask(kRead), GoldenBytes("01 03 02 01 7F F8 34"));
  EXPECT_EQ(Ask(kReadTwo), GoldenBytes("01 03 04 00 00 01 7F BA 43"));
  Set("two_points", "ignored");
  EXPECT_THAT(Ask(kReadTwo), IsEmpty());
}

TEST_F(SimulatorTest, Above16BitsOneRegisterIsNotEnough) {
  Encoder("bits: 18", "start_deg: 274.6582031");  // 200,000 of 2^18
  EXPECT_EQ(Ask(kReadTwo), GoldenBytes("01 03 04 00 03 0D 40 0F 53"));
  EXPECT_THAT(Ask(kRead), IsEmpty());
}

TEST_F(SimulatorTest, TheReplysCrcOfAQueryIsMsbFirst) {
  Encoder("bits: 14");
  EXPECT_EQ(Ask("FF A0 40 38"), GoldenBytes("FF A0 01 30 F8"));
  Set("query_crc", "lsb_first");
  EXPECT_EQ(Ask("FF A0 40 38"), GoldenBytes("FF A0 01 F8 30"));
}

TEST_F(SimulatorTest, AnswersANewAddressFromThere) {
  Encoder("bits: 14");
  EXPECT_EQ(Ask("01 A1 02 D8 51"), GoldenBytes("02 A1 C1 68"));
  EXPECT_EQ(Value("address"), "2");
  EXPECT_THAT(Ask(kRead), IsEmpty());
  EXPECT_EQ(Value("writes"), "1");
}

TEST_F(SimulatorTest, SetsZeroAndDirectionAndKeepsThemWithoutPower) {
  Encoder("bits: 16", "start_deg: 90");
  EXPECT_EQ(Ask("01 CC 02 F4 C1"), GoldenBytes("01 CC 02 F4 C1"));
  EXPECT_EQ(Value("single_turn"), "49152");
  EXPECT_EQ(Ask("01 CC 00 75 00"), GoldenBytes("01 CC 00 75 00"));
  EXPECT_EQ(Value("single_turn"), "0");
  Set("power", "off");
  EXPECT_THAT(Ask(kRead), IsEmpty());
  Set("power", "on");
  EXPECT_EQ(Ask(kRead), GoldenBytes("01 03 02 00 00 B8 44"));
  EXPECT_EQ(Value("counting"), "negative");
  EXPECT_EQ(Ask("01 CC 01 B4 C0"), GoldenBytes("01 CC 01 B4 C0"));
  EXPECT_EQ(Value("counting"), "positive");
  EXPECT_EQ(Value("writes"), "3");
}

TEST_F(SimulatorTest, AtAnotherRateItHearsNoiseAndIsHeardAsNoise) {
  Encoder("bits: 14");
  simulator_->OnBaud(19'200);
  EXPECT_EQ(Ask("01 CC 57 34 FE"), GoldenBytes("01 CC 57 34 FE")) << "at the old rate";
  EXPECT_EQ(Value("baud"), "57600");
  EXPECT_THAT(Ask(kRead), IsEmpty());
  EXPECT_EQ(Value("noise"), "1");
  simulator_->OnBaud(57'600);
  EXPECT_EQ(Ask(kRead).size(), 7U);
  Set("baud_reply", "new");
  const ByteList heard = Ask("01 CC 19 B4 CA");
  EXPECT_EQ(heard.size(), 5U);
  EXPECT_NE(heard, GoldenBytes("01 CC 19 B4 CA")) << "it comes at the new rate";
}

// Request and reply take their time, with 3.5 characters between them and what the encoder needs.
TEST_F(SimulatorTest, TakesTheTimeOfTheWire) {
  Encoder("bits: 14", "reply_us: 500");
  Ask(kRead);
  const double us = static_cast<double>(answered_ - kStart - kSecond) / 1e3;
  EXPECT_NEAR(us, (8 + 3.5 + 7) * 10 / 19'200 * 1e6 + 500, 1);
}

TEST_F(SimulatorTest, AFrameThatComesTooSoonIsNotHeard) {
  Encoder("bits: 14");
  const auto ignore = [](Bytes) {};
  simulator_->OnBytes(GoldenBytes(kRead), now_, ignore);
  // Request, silence, the encoder's 0.5 ms and reply take 10.1 ms; 1.8 ms of silence must follow.
  for (now_ += 11 * kMillisecond; simulator_->NextDue() <= now_;) simulator_->OnDue(now_, ignore);
  simulator_->OnBytes(GoldenBytes(kRead), now_, ignore);
  for (now_ += kSecond; simulator_->NextDue() <= now_;) simulator_->OnDue(now_, ignore);
  EXPECT_EQ(Value("short_gaps"), "1");
  EXPECT_EQ(Value("replies"), "1");
  EXPECT_EQ(Value("bad_crc"), "1");
}

TEST_F(SimulatorTest, TwoWithOneAddressDestroyEachOther) {
  ASSERT_EQ(Make("axis1: {bits: 14, address: 1}, axis2: {bits: 14, address: 2}", "axis2: {address: 1}"), "");
  EXPECT_NE(Ask(kRead), GoldenBytes("01 03 02 00 00 B8 44"));
  EXPECT_EQ(Value("collisions"), "1");
  EXPECT_EQ(Value("collisions", "axis2"), "1");
}

TEST_F(SimulatorTest, EachAnswersForItself) {
  ASSERT_EQ(Make("axis1: {bits: 14, address: 1}, axis2: {bits: 14, address: 17}", "axis1: {start_deg: 8.4265}"),
            "");
  EXPECT_EQ(Ask(kRead), GoldenBytes("01 03 02 01 7F F8 34"));
  const ByteList second = Ask("11 03 00 00 00 02 C6 9B");
  ASSERT_EQ(second.size(), 9U);
  EXPECT_EQ(second[0], 17);
  EXPECT_EQ(Value("requests"), "1");
  EXPECT_EQ(Value("requests", "axis2"), "1");
}

TEST_F(SimulatorTest, FaultsByName) {
  Encoder("bits: 14", "start_deg: 8.4265");
  const ByteList good = Ask(kRead);
  Set("fault", "off");
  EXPECT_THAT(Ask(kRead), IsEmpty());
  Set("fault", "garbage");
  EXPECT_EQ(Ask(kRead).size(), good.size());
  Set("fault", "bit_flip:1");
  EXPECT_EQ(Ask(kRead)[0], 0xFE);
  Set("fault", "short:1");
  EXPECT_LT(Ask(kRead).size(), good.size());
  Set("fault", "intermittent:1");
  EXPECT_THAT(Ask(kRead), IsEmpty());
  EXPECT_EQ(Value("unanswered"), "1");
  Set("fault", "request_flip:1");
  EXPECT_THAT(Ask(kRead), IsEmpty());
  Set("fault", "delayed:300");
  answered_ = 0;
  EXPECT_EQ(Ask(kRead), good);
  EXPECT_GT(answered_ % kSecond, 300 * kMillisecond);
  Set("fault", "echo");
  EXPECT_EQ(Ask(kRead).size(), 8 + good.size());
  Set("fault", "stuck");
  Set("speed_rpm", "60");
  now_ += 300 * kMillisecond;
  EXPECT_EQ(Ask(kRead), good);
  Set("fault", "none");
  EXPECT_NE(Ask(kRead), good);
}

TEST_F(SimulatorTest, NoiseStaysWithinItsBound) {
  Encoder("bits: 16", "start_deg: 180, noise_counts: 5");
  int other = 0;
  for (int i = 0; i < 200; ++i) {
    const ByteList reply = Ask(kRead);
    ASSERT_EQ(reply.size(), 7U);
    const int counts = reply[3] * 256 + reply[4];
    EXPECT_NEAR(counts, 32'768, 5);
    other += counts != 32'768 ? 1 : 0;
  }
  EXPECT_GT(other, 100);
}

TEST_F(SimulatorTest, AScriptActsAtItsInstants) {
  Encoder("bits: 16", "script: [{at_s: 2, counting: negative}, {at_s: 4, power: off}]");
  simulator_->OnDue(now_, [](Bytes) {});
  EXPECT_EQ(Value("counting"), "positive");
  now_ += 3 * kSecond;
  simulator_->OnDue(now_, [](Bytes) {});
  EXPECT_EQ(Value("counting"), "negative");
  EXPECT_EQ(Value("power"), "on");
  now_ += 3 * kSecond;
  simulator_->OnDue(now_, [](Bytes) {});
  EXPECT_EQ(Value("power"), "off");
}

TEST_F(SimulatorTest, UnpacedItAnswersAtOnce) {
  ASSERT_EQ(Make("axis1: {bits: 14}", "pace: unpaced, axis1: {start_deg: 8.4265}"), "");
  ByteList heard;
  simulator_->OnBytes(GoldenBytes(kRead), now_,
                      [&heard](Bytes bytes) { heard.assign(bytes.begin(), bytes.end()); });
  EXPECT_EQ(heard, GoldenBytes("01 03 02 01 7F F8 34"));
}

TEST_F(SimulatorTest, RefusesWrongKeysAndSaysWhatWouldBeRight) {
  const std::vector<std::array<std::string, 2>> cases = {
      {"axis1: {sped_rpm: 60}", "did you mean 'speed_rpm'"},
      {"axis1: {address: 248}", "address"},
      {"axis1: {baud: 115200}", "2400, 4800, 9600, 19200, 57600"},
      {"axis1: {counting: backwards}", "positive, negative"},
      {"axis1: {query_crc: either}", "msb_first, lsb_first"},
      {"axis1: {two_points: maybe}", "padded, ignored"},
      {"axis1: {baud_reply: both}", "old, new"},
      {"axis1: {fault: melted}", "melted"},
      {"axis1: {bits: 9}", "10 to 26 bits"},
      {"axis1: {start_deg: 400}", "0 to 360 deg"},
      {"axis1: {noise_counts: 1.5}", "whole number"},
      {"axis2: {}", "axis2"},
      {"pace: slow", "wire, unpaced"},
  };
  for (const auto& [simulate, said] : cases) {
    Host fresh;
    const std::string errors = fresh.Make("axis1: {bits: 16}", simulate);
    EXPECT_THAT(errors, HasSubstr(said)) << simulate;
    EXPECT_THAT(errors, HasSubstr("machine.yaml:1:")) << simulate;
  }
}

}  // namespace
}  // namespace axlecast::saa_modbus
