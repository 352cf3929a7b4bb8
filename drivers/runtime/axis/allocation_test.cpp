#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "drivers/runtime/axis/axis_fixture.h"
#include "drivers/runtime/axis/device_publisher.h"

namespace {

std::atomic<std::int64_t> allocations{0};

void* Allocate(std::size_t size) {
  ++allocations;
  void* memory = std::malloc(size == 0 ? 1 : size);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace

void* operator new(std::size_t size) { return Allocate(size); }
void* operator new[](std::size_t size) { return Allocate(size); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }

namespace axlecast {
namespace {

class CountingSink final : public MessageSink {
 public:
  void Publish(const std::string&, Bytes) override { ++messages_; }
  [[nodiscard]] std::int64_t messages() const { return messages_; }

 private:
  std::int64_t messages_ = 0;
};

// Readings at the full rate of the wire for three seconds, with damaged, doubtful and invalid ones among them.
TEST(ChannelAllocation, NoneAfterTheStart) {
  TestDevice device;
  device.config.block = true;
  Timebase time;
  CountingSink sink;
  MonoNs t = 1'000 * kSecond;
  time.Update(t, 0);
  DevicePublisher channel(device.bus, device.config, {{.boot_id = 1}, &time, &sink, {}, false});
  channel.OnLink(true, "", t);
  const AlarmSpec warning = {7, 0, 1, "battery_alarm", "Replace the battery soon."};
  const auto run = [&](int readings) {
    for (int i = 0; i < readings; ++i, t += 51 * kMicrosecond) {
      if (i % 500 == 250) {
        channel.OnError(ErrorKind::kChecksum, {t, t});
        continue;
      }
      Sample sample = ReadingAt(t, t / 1'000 + (i % 700 == 350 ? 60'000 : 0));
      sample.warning = i % 1'000 < 500;
      sample.error = i % 5'000 == 4'000;
      channel.OnSample(sample);
      channel.OnAlarm(warning, AlarmState::kLive, t);
      if (i % 2'000 == 0) channel.Tick(t);
    }
  };
  run(40'000);
  const std::int64_t before = allocations;
  const std::int64_t messages = sink.messages();
  run(60'000);
  EXPECT_EQ(allocations - before, 0);
  EXPECT_GT(sink.messages() - messages, 4'000);
  EXPECT_GT(channel.good(), 90'000);
  EXPECT_GT(channel.errors(ErrorKind::kImplausible), 50);
}

}  // namespace
}  // namespace axlecast
