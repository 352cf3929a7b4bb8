// The promise that nothing allocates per reading after the start, over the whole path from the line to the message.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "drivers/runtime/process/driver.h"
#include "tests/support/fake_clock.h"
#include "tests/support/fixed_secrets.h"
#include "tests/support/polled_device.h"
#include "tests/support/polled_family.h"

namespace {

std::atomic<std::int64_t> allocations = 0;

}  // namespace

// Not inlined: a compiler that sees malloc and free in them takes them for a mismatched pair.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace axlecast {
namespace {

// Answers every request 30 us later.
class SteadyLink final : public ByteLink {
 public:
  explicit SteadyLink(FakeClock& clock) : clock_(clock) {}

  [[nodiscard]] Result<> Open() override { return {}; }
  void Close() override {}
  [[nodiscard]] bool IsOpen() const override { return true; }
  [[nodiscard]] bool SetBaud(std::int64_t) override { return true; }
  [[nodiscard]] bool Write(Bytes bytes) override {
    const std::uint8_t high = static_cast<std::uint8_t>(count_ >> 8);
    const std::uint8_t low = static_cast<std::uint8_t>(count_++);
    reply_ = {bytes[0], bytes[1], high, low, static_cast<std::uint8_t>(bytes[0] + bytes[1] + high + low)};
    return true;
  }
  [[nodiscard]] ReadResult Read(std::span<std::uint8_t> into, MonoNs) override {
    clock_.Advance(30 * kMicrosecond);
    std::copy(reply_.begin(), reply_.end(), into.begin());
    return {Status::kOk, reply_.size()};
  }
  [[nodiscard]] ReadResult ReadNow(std::span<std::uint8_t>) override { return {}; }
  [[nodiscard]] Status Wait(MonoNs until) override {
    clock_.MoveTo(until);
    return Status::kTimeout;
  }
  void Wake() override {}
  [[nodiscard]] LineErrors Errors() const override { return {}; }

 private:
  FakeClock& clock_;
  std::uint16_t count_ = 0;
  std::array<std::uint8_t, 5> reply_{};
};

class CountingSink final : public MessageSink {
 public:
  void Publish(const std::string&, Bytes) override { ++messages; }
  std::int64_t messages = 0;
};

// Messages of once a second may allocate; 33,000 readings, 1,000 POSITION, 830 blocks and 1,100 WIRE a second not.
TEST(AllocationTest, NothingAllocatesPerReading) {
  FakeClock clock;
  SteadyLink link(clock);
  FixedSecrets secrets;
  CountingSink data;
  CountingSink commands;
  BusConfig config = PolledBus(1);
  config.poll_hz = 0;
  config.capture = true;
  config.devices[0].block = true;
  Driver driver(config, {}, Origin{.boot_id = 42},
                {.link = &link,
                 .secrets = &secrets,
                 .clock = &clock,
                 .data = &data,
                 .commands = &commands,
                 .log = [](LogLevel, std::string_view) {},
                 .link_warnings = {}});
  const MonoNs start = clock.Now();
  while (clock.Now() < start + kSecond) driver.RunOnce();
  const std::int64_t allocated = allocations;
  const std::int64_t published = data.messages;
  while (clock.Now() < start + 4 * kSecond) driver.RunOnce();
  EXPECT_GT(data.messages - published, 6'000);
  EXPECT_LT(allocations - allocated, 600);
}

}  // namespace
}  // namespace axlecast
