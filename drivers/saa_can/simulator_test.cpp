// The simulator against the manual's own frames.
#include "drivers/saa_can/simulator.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

namespace axlecast::saa_can {
namespace {

using Vector = std::vector<std::uint8_t>;

class SaaCanSimulator : public testing::Test {
 protected:
  void Make(std::vector<SaaNode::Setup> setups) {
    std::vector<CanBus::Unit> units;
    for (std::size_t i = 0; i < setups.size(); ++i) {
      units.push_back({std::string(1, static_cast<char>('a' + i)), std::make_unique<SaaNode>(setups[i])});
    }
    bus_ = std::make_unique<CanBus>(250'000, std::move(units));
    RunTo(kSecond);
    received_.clear();
  }
  void RunTo(MonoNs to) {
    while (bus_->NextDue() <= to) {
      now_ = std::max(now_, std::max(bus_->NextDue(), MonoNs{1}));
      bus_->OnDue(now_, transmit_);
    }
    now_ = to;
  }
  // Everything that comes within 50 ms.
  Vector Ask(std::uint32_t id, const Vector& data) {
    received_.clear();
    acknowledged_ = bus_->OnFrame({.id = id, .data = InlineBytes<kMaxCanData>(data)}, now_, transmit_);
    RunTo(now_ + 50 * kMillisecond);
    return received_.empty() ? Vector{} : received_.back();
  }
  [[nodiscard]] std::string Of(const std::string& key, const std::string& device = "a") const {
    for (const auto& [name, value] : bus_->State(device, now_)) {
      if (name == key) return value;
    }
    return "";
  }
  static Vector Packet(std::uint32_t id, Vector data) {
    data.resize(8);
    Vector packet = {0, 0, static_cast<std::uint8_t>(id >> 8), static_cast<std::uint8_t>(id)};
    packet.insert(packet.end(), data.begin(), data.end());
    return packet;
  }

  std::unique_ptr<CanBus> bus_;
  MonoNs now_ = 0;
  bool acknowledged_ = false;
  std::vector<Vector> received_;
  Simulator::Transmit transmit_ = [this](Bytes bytes) { received_.emplace_back(bytes.begin(), bytes.end()); };
};

// (3) ①: the example of (5), 215.3100 degrees at 14 bits.
TEST_F(SaaCanSimulator, AnswersJogWithThePosition) {
  Make({{.angle = AngleFromDegrees(215.3102)}});
  EXPECT_EQ(Ask(0x220, {0x80, 0x20, 0, 0, 0, 0, 0, 0}), Packet(0x120, {0x47, 0x26}));
  EXPECT_TRUE(acknowledged_);
}

TEST_F(SaaCanSimulator, SendsByItselfOnceItIsStarted) {
  Make({{.node = 0xFF}});
  RunTo(now_ + kSecond);
  EXPECT_TRUE(received_.empty());
  Ask(0x2FF, {0x01, 0xFF, 0, 0, 0, 0, 0, 0});
  received_.clear();
  RunTo(now_ + 10 * kSecond);
  EXPECT_NEAR(static_cast<double>(received_.size()), 94, 1);  // 106.4 ms
  Ask(0x2FF, {0x31, 0xFF, 50, 0, 0, 0, 0, 0});
  received_.clear();
  RunTo(now_ + 10 * kSecond);
  EXPECT_NEAR(static_cast<double>(received_.size()), 470, 1);
}

// (3) ④ to ⑧.
TEST_F(SaaCanSimulator, AcknowledgesCommandsWithTheirCode) {
  Make({{.angle = AngleFromDegrees(100)}});
  EXPECT_EQ(Ask(0x220, {0x22, 0x20, 0, 0, 0, 0, 0, 0}), Packet(0x120, {0x22, 0x00}));
  EXPECT_EQ(Ask(0x220, {0x31, 0x20, 10, 0, 0, 0, 0, 0}), Packet(0x120, {0x31, 0x00}));
  EXPECT_EQ(Ask(0x220, {0x20, 0x20, 0, 0, 0, 0, 0, 0}), Packet(0x120, {0x20, 0x00}));
  EXPECT_EQ(Ask(0x220, {0x80, 0x20, 0, 0, 0, 0, 0, 0}), Packet(0x120, {0x00, 0x00}));
}

// "DLC are 8"; NN in D1; zeros behind.
TEST_F(SaaCanSimulator, DropsWhatIsNotAsPrinted) {
  Make({{}});
  const std::vector<Vector> wrong = {{0x80, 0x20},
                                     {0x80, 0x21, 0, 0, 0, 0, 0, 0},
                                     {0x80, 0x20, 0, 0, 0, 0, 0, 1},
                                     {0x81, 0x20, 0, 0, 0, 0, 0, 0},
                                     {0x31, 0x20, 0, 0, 0, 0, 0, 0}};
  for (const Vector& data : wrong) EXPECT_TRUE(Ask(0x220, data).empty());
  EXPECT_EQ(Of("ignored"), std::to_string(wrong.size()));
  EXPECT_TRUE(Ask(0x221, {0x80, 0x21, 0, 0, 0, 0, 0, 0}).empty());
  EXPECT_TRUE(acknowledged_) << "a node acknowledges whatever is on the bus";
}

// (3) ②: every node that receives it obeys.
TEST_F(SaaCanSimulator, TheDialogueRenumbersEveryNode) {
  Make({{.node = 0x20}, {.node = 0x21}});
  EXPECT_TRUE(Ask(0x7E5, {0x11, 0x33, 0, 0, 0, 0, 0, 0}).empty()) << "not in configuration mode";
  EXPECT_TRUE(Ask(0x7E5, {0x04, 0x01, 0, 0, 0, 0, 0, 0}).empty()) << "not answered";
  EXPECT_EQ(Ask(0x7E5, {0x11, 0x33, 0, 0, 0, 0, 0, 0}), Packet(0x7E5, {0x11, 0x00}));
  EXPECT_EQ(received_.size(), 2U);
  EXPECT_EQ(Of("node", "a"), "51");
  EXPECT_EQ(Of("node", "b"), "51");
}

// (3) ③.
TEST_F(SaaCanSimulator, AtAnotherBitRateItIsNotHeard) {
  Make({{}});
  Ask(0x7E5, {0x04, 0x01, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(Ask(0x7E5, {0x13, 0x00, 0x02, 0, 0, 0, 0, 0}), Packet(0x7E5, {0x13, 0x00}));
  EXPECT_EQ(Of("bitrate"), "500000");
  EXPECT_TRUE(Ask(0x220, {0x80, 0x20, 0, 0, 0, 0, 0, 0}).empty());
  EXPECT_FALSE(acknowledged_);
  bus_->OnBaud(500'000);
  EXPECT_EQ(Ask(0x220, {0x80, 0x20, 0, 0, 0, 0, 0, 0}), Packet(0x120, {}));
}

TEST_F(SaaCanSimulator, WithoutPowerNothingIsAcknowledged) {
  Make({{}});
  EXPECT_EQ(ErrorText(bus_->Set("a", "power", "off", now_)), "");
  Ask(0x220, {0x80, 0x20, 0, 0, 0, 0, 0, 0});
  EXPECT_FALSE(acknowledged_);
  EXPECT_EQ(ErrorText(bus_->Set("a", "power", "on", now_)), "");
  received_.clear();
  RunTo(now_ + kSecond);
  EXPECT_EQ(received_.size(), 1U) << "one position when it is switched on";
}

TEST_F(SaaCanSimulator, NamesWhatItCannotSet) {
  Make({{}});
  EXPECT_NE(ErrorText(bus_->Set("a", "fault", "echo", now_)), "");
  EXPECT_NE(ErrorText(bus_->Set("a", "node", "0", now_)), "");
  EXPECT_NE(ErrorText(bus_->Set("z", "node", "1", now_)), "");
}

}  // namespace
}  // namespace axlecast::saa_can
