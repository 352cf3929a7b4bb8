#include "tests/campaign/device_under_test.h"

namespace axlecast {

DeviceUnderTest::DeviceUnderTest(const BusConfig& bus, MessageSink& sink, MonoNs now)
    : channel_(bus, bus.devices[0], {.origin = {.boot_id = 1}, .time = &time_, .sink = &sink, .on_outcome = {}}),
      device_(bus.family->make_device(bus, bus.devices[0], channel_, secrets_)) {
  time_.Update(now, 1'700'000'000'000'000);
  channel_.OnLink(true, "", now);
  device_->On(
      {.kind = Event::Kind::kLinkUp, .sent = {now, now}, .received = {now, now}, .request = {}, .bytes = {}});
}

void DeviceUnderTest::Tick(MonoNs now) {
  if (now < next_tick_) return;
  next_tick_ = now + 100 * kMillisecond;
  time_.Update(now, 1'700'000'000'000'000 + now / kMicrosecond);
  channel_.Tick(now);
}

}  // namespace axlecast
