#include "drivers/runtime/process/driver.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <atomic>
#include <axlecast/command_status_t.hpp>
#include <axlecast/driver_status_t.hpp>
#include <memory>
#include <set>
#include <thread>

#include "core/messages/message.h"
#include "platform/net/lcm_port.h"
#include "platform/os/system_clock.h"
#include "tests/support/counting_family.h"
#include "tests/support/fixed_secrets.h"
#include "tests/support/polled_device.h"
#include "tests/support/polled_family.h"

namespace axlecast {
namespace {

constexpr std::int64_t kBoot = 42;

// Devices on a line that answers at once, in real time.
class PromptLink final : public ByteLink {
 public:
  [[nodiscard]] Result<> Open() override { return {}; }
  void Close() override {}
  [[nodiscard]] bool IsOpen() const override { return true; }
  [[nodiscard]] bool SetBaud(std::int64_t) override { return true; }
  [[nodiscard]] bool Write(Bytes bytes) override {
    reply_ = PolledDevice::Reply(bytes[0], bytes[1], 1'000);
    return true;
  }
  [[nodiscard]] ReadResult Read(std::span<std::uint8_t> into, MonoNs) override {
    std::copy(reply_.begin(), reply_.end(), into.begin());
    return {Status::kOk, reply_.size()};
  }
  [[nodiscard]] ReadResult ReadNow(std::span<std::uint8_t>) override { return {}; }
  [[nodiscard]] Status Wait(MonoNs) override {
    std::this_thread::yield();
    return woken_.exchange(false) ? Status::kWoken : Status::kTimeout;
  }
  void Wake() override { woken_ = true; }
  [[nodiscard]] LineErrors Errors() const override { return {}; }

 private:
  std::vector<std::uint8_t> reply_;
  std::atomic<bool> woken_ = false;
};

class NullSink final : public MessageSink {
 public:
  void Publish(const std::string&, Bytes) override {}
};

// Two hundred orders come on the command thread while the bus's thread reads: each is done exactly once.
TEST(CommandThreadTest, OrdersCrossTheThreads) {
  const SystemClock clock;
  PromptLink link;
  FixedSecrets secrets;
  NullSink data;
  LcmPort port("memq://", "");
  ASSERT_EQ(port.problem(), "");
  std::atomic<int> done = 0;
  std::set<std::int64_t> ids;  // of the command thread
  ASSERT_TRUE(port.Subscribe("DRIVER_STATUS/rs485-0", [&](const std::string&, Bytes message) {
    const auto status = DecodeMessage<driver_status_t>(message);
    if (!status || status->state != command_status_t::STATE_SUCCEEDED) return;
    if (ids.insert(status->id[0] + 256 * status->id[1]).second) ++done;
  }));
  BusConfig config = PolledBus(1);
  config.poll_hz = 0;
  Driver driver(config, UnsignedBridge(), Origin{.boot_id = kBoot},
                {.link = &link,
                 .secrets = &secrets,
                 .clock = &clock,
                 .data = &data,
                 .commands = &port,
                 .log = [](LogLevel, std::string_view) {},
                 .link_warnings = {}});
  const MonoNs online = clock.Now() + 300 * kMillisecond;
  while (clock.Now() < online) driver.RunOnce();

  const MonoNs give_up = clock.Now() + 30 * kSecond;
  {
    const CommandThread thread(port, config, driver);
    constexpr int kOrders = 200;
    int sent = 0;
    while (done < kOrders && clock.Now() < give_up) {
      if (sent == done && sent < kOrders) {
        ++sent;
        const auto order =
            Enveloped(OrderMessage(kBoot, sent, NumberedId(static_cast<std::uint32_t>(sent)), "axis1", "touch"));
        port.Publish("DRIVER_COMMAND/rs485-0", order);
        port.Publish("DRIVER_COMMAND/rs485-0", order);  // as a bridge that got no answer yet
      }
      driver.RunOnce();
    }
    EXPECT_EQ(sent, kOrders);
  }
  EXPECT_EQ(done, 200);
  driver.Stop();
}

// Forged commands as fast as they can be verified, on another thread: the slots of the bus continue, far more often
// than signatures are verified.
TEST(CommandThreadTest, AFloodOfForgedOrdersDoesNotDelayTheBus) {
  const SystemClock clock;
  PromptLink link;
  FixedSecrets secrets;
  NullSink sink;
  const SigningKey bridge_key = SigningKey::Generate();
  const SigningKey stranger = SigningKey::Generate();
  BridgeConfig bridge;
  bridge.bridge.public_key = bridge_key.public_key();
  BusConfig config = PolledBus(1);
  config.poll_hz = 0;
  Driver driver(config, bridge, Origin{.boot_id = kBoot},
                {.link = &link,
                 .secrets = &secrets,
                 .clock = &clock,
                 .data = &sink,
                 .commands = &sink,
                 .log = [](LogLevel, std::string_view) {},
                 .link_warnings = {}});
  constexpr int kForged = 2'000;
  const auto forged = Enveloped(OrderMessage(kBoot, 1, NumberedId(1), "axis1", "touch"), &stranger);
  std::atomic<bool> flooding = true;
  std::thread flood([&] {
    for (int i = 0; i < kForged; ++i) driver.command_server().OnDriverCommand(forged);
    flooding = false;
  });
  std::vector<MonoNs> turns;
  const MonoNs began = clock.Now();
  while (flooding) {
    const MonoNs before = clock.Now();
    driver.RunOnce();
    turns.push_back(clock.Now() - before);
  }
  const MonoNs one_order = (clock.Now() - began) / kForged;
  flood.join();
  EXPECT_EQ(driver.command_server().refused(), kForged);
  // The median, because the longest slot depends on the other load of this computer.
  std::nth_element(turns.begin(), turns.begin() + static_cast<std::ptrdiff_t>(turns.size() / 2), turns.end());
  EXPECT_LT(turns[turns.size() / 2], one_order / 2);
  driver.Stop();
}

}  // namespace
}  // namespace axlecast
