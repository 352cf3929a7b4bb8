#include "tests/simulation/time_process.h"

#include <algorithm>
#include <cstdlib>

#include "core/base/text.h"

namespace axlecast::simulation {
namespace {

constexpr MonoNs kConversion = 4;  // ns: how exactly the simulation converts its own instants

}  // namespace

void TimeProcess::Start() {
  origin_ = host_.NewOrigin(machine_.machine);
  keeper_ = std::make_unique<TimeKeeper>(TimeKeeper::Limits{}, IsRoot() ? BaseId() : 0);
  seq_ = 0;
  frozen_until_ = 0;
  Cycle(++life_);
}

void TimeProcess::Kill() {
  ++life_;
  keeper_.reset();
}

void TimeProcess::Cycle(std::int64_t life) {
  if (life != life_) return;
  if (schedule_.now() < frozen_until_) {
    schedule_.At(frozen_until_, [this, life] { Cycle(life); });
    return;
  }
  Publish();
  if (!IsRoot()) Request();
  schedule_.After(kCycle + host_.Late(), [this, life] { Cycle(life); });
}

void TimeProcess::Request() {
  const MonoNs sent = host_.clock.RawAt(schedule_.now());
  network_.SendTo(host_, root_.host_, [this, sent, life = life_] { root_.OnRequest(*this, sent, life); });
}

void TimeProcess::OnRequest(TimeProcess& from, MonoNs sent, std::int64_t life) {
  if (!runs() || schedule_.now() < frozen_until_) return;
  const MonoNs asked = host_.clock.RawAt(schedule_.now());
  schedule_.After(host_.Late(), [this, &from, sent, asked, life] {
    const MonoNs answered = host_.clock.RawAt(schedule_.now());
    network_.SendTo(host_, from.host_, [this, &from, sent, asked, answered, life] {
      if (life != from.life_ || from.schedule_.now() < from.frozen_until_) return;
      const MonoNs received = from.host_.clock.RawAt(schedule_.now());
      static_cast<void>(from.keeper_->OnExchange({sent, received, asked, answered}, BaseId()));
    });
  });
}

void TimeProcess::Publish() {
  const MonoNs now = schedule_.now();
  const HostClock& clock = host_.clock;
  keeper_->OnClocks(
      {clock.RawAt(now - 60), clock.MonoAt(now - 30), clock.MonoAt(now - 20) + kSecond, clock.RawAt(now)});
  time_quality_t message{};
  origin_.Set(message);
  keeper_->Describe(message);
  message.utime = clock.UtcMicroseconds();
  message.utc_half_width_ns = -1;
  message.seq = seq_++;
  message.host = host_.name;
  message.root = machine_.time.root;
  promises_.Count("time claims published");
  if (message.half_width_ns >= 0) {
    promises_.Count("time claims compared with the clock of the root");
    const MonoNs truth = root_.host_.clock.RawAt(clock.TimeOf(message.mono_ns));
    const MonoNs off = std::abs(truth - message.base_ns) - message.half_width_ns;
    if (off > kConversion)
      promises_.Breach(
          Text("the claim of %s misses the truth by %lld ns", host_.name.c_str(), static_cast<long long>(off)));
  }
  const std::vector<std::uint8_t> bytes = Encoded(message);
  network_.Send(host_, Port::kData, "TIME/" + host_.name, bytes);
  network_.Send(host_, Port::kCommands, "DRIVER_TIME/" + host_.name, bytes);
}

}  // namespace axlecast::simulation
