#include "tools/axlecast/run/simulation_server.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <string>
#include <thread>

#include "drivers/hal/serial_port.h"
#include "drivers/hal/simulated_can.h"
#include "drivers/hal/simulated_spi.h"
#include "platform/os/descriptor.h"
#include "platform/os/system_clock.h"
#include "tests/support/temporary_folder.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

// Answers every byte with that byte plus one; an 'L' a little later, a 'B' with the thousands of the host's baud rate,
// a pulse with its line and its length in us; a frame with the next identifier, unless it is deaf.
class PlusOne final : public Simulator {
 public:
  void OnBytes(Bytes bytes, MonoNs now, const Transmit& transmit) override {
    for (const std::uint8_t byte : bytes) {
      const auto answer = static_cast<std::uint8_t>(byte == 'B' ? baud_ / 1'000 : byte + step_);
      if (byte == 'L') {
        due_ = now + 5 * kMillisecond;
      } else {
        transmit(Bytes(&answer, 1));
      }
    }
  }
  [[nodiscard]] bool OnFrame(const CanFrame& frame, MonoNs now, const Transmit& transmit) override {
    if (step_ == 0) return false;
    if (frame.data.empty()) due_ = now + 5 * kMillisecond;
    if (!frame.data.empty()) transmit(ToPacket({.id = frame.id + static_cast<std::uint32_t>(step_), .data = {}}));
    return true;
  }
  void OnTransfer(const SpiTransfer& transfer, MonoNs, std::span<std::uint8_t> rx) override {
    std::transform(transfer.tx.begin(), transfer.tx.end(), rx.begin(),
                   [this](std::uint8_t byte) { return static_cast<std::uint8_t>(byte + step_); });
  }
  void OnBaud(std::int64_t baud) override { baud_ = baud; }
  void OnPulse(std::uint8_t line, MonoNs low, MonoNs, const Transmit& transmit) override {
    transmit(std::array<std::uint8_t, 2>{line, static_cast<std::uint8_t>(low / kMicrosecond)});
  }
  [[nodiscard]] MonoNs NextDue() const override { return due_; }
  void OnDue(MonoNs, const Transmit& transmit) override {
    due_ = kNever;
    transmit(std::array<std::uint8_t, 4>{'M', 0, 0, 0});  // a frame too
  }
  [[nodiscard]] Result<> Set(std::string_view device, std::string_view key, std::string_view value,
                             MonoNs) override {
    if (device != "unit" || key != "step") return Failure("no such thing");
    step_ = std::atoi(std::string(value).c_str());
    return {};
  }
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> State(std::string_view, MonoNs) const override {
    return {{"step", std::to_string(step_)}, {"mood", "calm"}, {"rate", std::to_string(baud_)}};
  }

 private:
  int step_ = 1;
  std::int64_t baud_ = 0;
  MonoNs due_ = kNever;
};

class SimulationServerTest : public testing::Test {
 protected:
  explicit SimulationServerTest(LinkKind link = LinkKind::kSerial, const char* suffix = "/b0.pty") {
    place_ = {.bus = "b0",
              .devices = {"unit"},
              .link = link,
              .port = directory_ + suffix,
              .control = directory_ + "/b0.ctl",
              .lock = directory_ + "/b0.sim",
              .lines = directory_ + "/b0.lines"};
    EXPECT_EQ(ErrorText(server_.Add(place_, std::make_unique<PlusOne>())), "");
    thread_ = std::thread([this] { EXPECT_EQ(ErrorText(server_.Run()), ""); });
  }
  ~SimulationServerTest() override {
    server_.Stop();
    thread_.join();
  }

  [[nodiscard]] Descriptor OpenHost() const { return Descriptor(open(place_.port.c_str(), O_RDWR | O_NOCTTY)); }
  static char Exchange(const Descriptor& host, char request) {
    if (write(host.get(), &request, 1) != 1) return '!';
    pollfd wanted{host.get(), POLLIN, 0};
    if (poll(&wanted, 1, 2'000) != 1) return '?';
    char reply = '0';
    return read(host.get(), &reply, 1) == 1 ? reply : '!';
  }
  [[nodiscard]] Json Ask(const Json& question) const {
    return Json::parse(AskControlSocket(place_.control, question.dump()), nullptr, false);
  }

  const TemporaryFolder folder_;
  const std::string directory_ = folder_.path();
  SimulationServer::BusPlace place_;
  SystemClock clock_;
  SimulationServer server_{clock_};
  std::thread thread_;
};

TEST_F(SimulationServerTest, HostsComeAndGo) {
  for (int i = 0; i < 3; ++i) {
    const Descriptor host = OpenHost();
    EXPECT_EQ(Exchange(host, 'a'), 'b');
    EXPECT_EQ(Exchange(host, 'x'), 'y');
  }
}

TEST_F(SimulationServerTest, LateAnswersComeWhenTheyAreDue) {
  const Descriptor host = OpenHost();
  EXPECT_EQ(Exchange(host, 'L'), 'M');
}

TEST_F(SimulationServerTest, ChangesWhileItRuns) {
  const Descriptor host = OpenHost();
  EXPECT_EQ(Exchange(host, 'a'), 'b');
  const Json set = {{"set", {{"unit", "step", "2"}, {"unit", "size", "1"}}}};
  EXPECT_EQ(Ask(set), Json({{"errors", {"no such thing"}}}));
  EXPECT_EQ(Exchange(host, 'a'), 'c');
  const Json state = Ask({{"show", true}});
  EXPECT_EQ(state["devices"]["unit"]["step"], 2) << "numbers are numbers";
  EXPECT_EQ(state["devices"]["unit"]["mood"], "calm");
  EXPECT_EQ(state["host"], true);
}

TEST_F(SimulationServerTest, UnpluggedTheHostLosesItsLineAndFindsItAgainWhenPlugged) {
  const Descriptor host = OpenHost();
  EXPECT_EQ(Exchange(host, 'a'), 'b');
  EXPECT_EQ(Ask({{"plugged", false}})["errors"], Json::array());
  EXPECT_FALSE(std::filesystem::exists(place_.port));
  EXPECT_EQ(Exchange(host, 'a'), '!');
  EXPECT_EQ(Ask({{"plugged", true}})["errors"], Json::array());
  const Descriptor again = OpenHost();
  EXPECT_EQ(Exchange(again, 'a'), 'b');
}

TEST_F(SimulationServerTest, TheSimulatorKnowsTheHostsRateFromTheFirstByteOn) {
  SerialPort host({.path = place_.port, .format = {.baud = 38'400}}, clock_);
  ASSERT_EQ(ErrorText(host.Open()), "");
  const auto rate = [&] {
    std::array<std::uint8_t, 1> reply{};
    EXPECT_TRUE(host.Write(std::array<std::uint8_t, 1>{'B'}));
    EXPECT_EQ(host.Read(reply, clock_.Now() + 60 * kSecond).status, ByteLink::Status::kOk);
    return int{reply[0]};
  };
  EXPECT_EQ(rate(), 38);
  ASSERT_TRUE(host.SetBaud(115'200));
  EXPECT_EQ(rate(), 115);
  ASSERT_TRUE(host.SetBaud(12'345));
  EXPECT_EQ(rate(), 12);
}

TEST_F(SimulationServerTest, PulsesReachTheSimulator) {
  const Descriptor host = OpenHost();
  EXPECT_EQ(Exchange(host, 'a'), 'b');
  SimulatedLines lines(place_.lines, clock_);
  ASSERT_EQ(ErrorText(lines.Open()), "");
  ASSERT_TRUE(lines.Pulse(3, 20 * kMicrosecond));
  std::array<char, 2> reply{};
  ASSERT_EQ(read(host.get(), reply.data(), reply.size()), 2);
  EXPECT_EQ(reply[0], 3);
  EXPECT_EQ(reply[1], 20);
}

// ---- CAN ----

class SimulatedCanServerTest : public SimulationServerTest {
 protected:
  SimulatedCanServerTest() : SimulationServerTest(LinkKind::kCan, "/b0.can") {
    EXPECT_EQ(ErrorText(can_.Open()), "");
  }
  // The next frame that comes within 60 s; "own" behind one of the host's.
  [[nodiscard]] std::string Next() {
    FrameLink::Received received;
    if (can_.Wait(clock_.Now() + 60 * kSecond) != Link::Status::kOk) return "nothing";
    const Link::Status status = can_.Receive(received);
    if (status != Link::Status::kOk) return status == Link::Status::kLost ? "lost" : "no frame";
    return std::to_string(received.frame.id) + (received.own ? " own" : "");
  }

  SimulatedCan can_{place_.port, 500'000, clock_};
};

TEST_F(SimulatedCanServerTest, FramesPassBothWays) {
  EXPECT_EQ(can_.Send({.id = 10, .data = {1}}), FrameLink::SendResult::kQueued);
  EXPECT_EQ(Next(), "10 own");
  EXPECT_EQ(Next(), "11");
  EXPECT_EQ(Ask({{"show", true}})["devices"]["unit"]["rate"], 500'000);
}

TEST_F(SimulatedCanServerTest, LateFramesComeWhenTheyAreDue) {
  EXPECT_EQ(can_.Send({.id = 10, .data = {}}), FrameLink::SendResult::kQueued);
  EXPECT_EQ(Next(), "10 own");
  EXPECT_EQ(Next(), std::to_string('M' << 24));
}

TEST_F(SimulatedCanServerTest, AFrameThatNobodyAcknowledgesGoesOutWhenSomebodyIsThere) {
  EXPECT_EQ(Ask({{"set", {{"unit", "step", "0"}}}})["errors"], Json::array());
  EXPECT_EQ(can_.Send({.id = 10, .data = {1}}), FrameLink::SendResult::kQueued);
  EXPECT_EQ(Next(), "no frame") << "but the report that nobody has acknowledged it";
  EXPECT_EQ(can_.Controller().state, CanController::State::kPassive);
  EXPECT_EQ(Ask({{"set", {{"unit", "step", "3"}}}})["errors"], Json::array());
  EXPECT_EQ(Next(), "10 own");
  EXPECT_EQ(Next(), "13");
}

TEST_F(SimulatedCanServerTest, UnpluggedTheHostLosesItsBusAndFindsItAgainWhenPlugged) {
  EXPECT_EQ(Ask({{"show", true}})["host"], true);
  EXPECT_EQ(Ask({{"plugged", false}})["errors"], Json::array());
  EXPECT_EQ(Ask({{"show", true}})["plugged"], false);
  EXPECT_EQ(Next(), "lost");
  EXPECT_THAT(ErrorText(can_.Open()), testing::HasSubstr("simulate FILE --bus b0"));
  EXPECT_EQ(Ask({{"plugged", true}})["errors"], Json::array());
  EXPECT_EQ(ErrorText(can_.Open()), "");
  EXPECT_EQ(can_.Send({.id = 10, .data = {1}}), FrameLink::SendResult::kQueued);
  EXPECT_EQ(Next(), "10 own");
}

// What nodes on a real interface do is shown in tests/vm.
TEST_F(SimulatedCanServerTest, AnInterfaceThatDoesNotExistIsNamed) {
  SimulationServer second(clock_);
  place_.bus = "b1";
  place_.control = directory_ + "/b1.ctl";
  place_.lock = directory_ + "/b1.sim";
  place_.lines = "";
  place_.interface = "nocan7";
  const std::string problem = ErrorText(second.Add(place_, std::make_unique<PlusOne>()));
  EXPECT_THAT(problem, testing::AnyOf(testing::HasSubstr("nocan7 does not exist"),
                                      testing::HasSubstr("this kernel has no CAN"),
                                      testing::HasSubstr("this kernel has no raw CAN")));
}

// ---- SPI ----

class SimulatedSpiServerTest : public SimulationServerTest {
 protected:
  SimulatedSpiServerTest() : SimulationServerTest(LinkKind::kSpi, "/b0.spi") {
    EXPECT_EQ(ErrorText(spi_.Open()), "");
  }
  [[nodiscard]] int Clocked(std::uint8_t out) {
    std::array<std::uint8_t, 2> in{};
    if (!spi_.Write(std::array<std::uint8_t, 1>{out})) return -1;
    return spi_.ReadNow(in).count == 1 ? int{in[0]} : -2;
  }

  SimulatedSpi spi_{place_.port, {.mode = 2, .clock_hz = 1'000'000}, clock_};
};

TEST_F(SimulatedSpiServerTest, TransfersReachTheSimulator) {
  EXPECT_EQ(Clocked(7), 8);
  EXPECT_EQ(Ask({{"set", {{"unit", "step", "5"}}}})["errors"], Json::array());
  EXPECT_EQ(Clocked(7), 12);
  EXPECT_EQ(Ask({{"show", true}})["port"], place_.port);
}

TEST_F(SimulatedSpiServerTest, UnpluggedTheHostLosesItsBusAndFindsItAgainWhenPlugged) {
  EXPECT_EQ(Ask({{"plugged", false}})["errors"], Json::array());
  EXPECT_EQ(Clocked(7), -1);
  EXPECT_NE(ErrorText(spi_.Open()), "");
  EXPECT_EQ(Ask({{"plugged", true}})["errors"], Json::array());
  EXPECT_EQ(ErrorText(spi_.Open()), "");
  EXPECT_EQ(Clocked(7), 8);
}

// ---- all of them ----

TEST_F(SimulationServerTest, OneSimulatorPerBus) {
  SimulationServer second(clock_);
  EXPECT_THAT(ErrorText(second.Add(place_, std::make_unique<PlusOne>())), testing::HasSubstr("simulated already"));
  const Descriptor host = OpenHost();
  EXPECT_EQ(Exchange(host, 'a'), 'b') << "the first still runs";
}

TEST_F(SimulationServerTest, NonsenseGetsAnAnswerToo) {
  EXPECT_TRUE(Ask("hello").contains("errors"));
  EXPECT_TRUE(Ask(Json::array({1, 2})).contains("errors"));
  EXPECT_FALSE(Ask({{"set", {1}}})["errors"].empty());
  EXPECT_FALSE(Ask({{"set", "all"}})["errors"].empty());
  EXPECT_FALSE(Ask({{"set", {{"unit", "step", 2}}}})["errors"].empty());
  const Descriptor host = OpenHost();
  EXPECT_EQ(Exchange(host, 'a'), 'b');
}

}  // namespace
}  // namespace axlecast
