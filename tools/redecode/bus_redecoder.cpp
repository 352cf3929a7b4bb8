#include "tools/redecode/bus_redecoder.h"

#include <algorithm>
#include <string_view>

namespace axlecast {
namespace {

constexpr MonoNs kTick = 100 * kMillisecond;  // of a driver's channels
constexpr MonoNs kLatest = kNever / 2;
constexpr MonoNs kMaxTicks =
    60 * kSecond;  // a longer silence is skipped: channels have said all that they have to say
constexpr std::string_view kGapReason = "the recording has a gap here";

// What a driver can have sent; arithmetic with it stays in range.
bool IsInRange(const wire_t& message) {
  const auto within = [](std::int64_t value, std::int64_t maximum) { return value >= 0 && value <= maximum; };
  return within(message.mono_ns, kLatest) && within(message.utime, kLatest / kMicrosecond) &&
         within(message.seq, kLatest) && within(message.dropped, kLatest);
}

Event LinkEvent(Event::Kind kind, MonoNs now) {
  return {.kind = kind, .sent = {}, .received = {now, now}, .request = {}, .bytes = {}};
}

}  // namespace

BusRedecoder::BusRedecoder(const BusConfig& bus, MessageSink& sink) : bus_(bus), sink_(sink) {}

void BusRedecoder::On(const wire_t& message) {
  ++messages_;
  if (!IsInRange(message)) {
    ++unreadable_;
    return;
  }
  if (boot_id_ != message.boot_id) Start(message);
  if (time_.Update(message.mono_ns, message.utime)) {
    for (Unit& unit : units_) unit.channel->OnClockStepped();
  }
  FollowNumbers(message);
  reader_.Read(message, [this](const Event& event) { Deliver(event); });
}

void BusRedecoder::OnDeviceInfo(const device_info_t& info) {
  if (boot_id_ != info.boot_id) return;
  for (std::size_t i = 0; i < units_.size(); ++i) {
    Unit& unit = units_[i];
    if (bus_.devices[i].name != info.device || unit.datum_utime == info.datum_utime) continue;
    unit.datum_utime = info.datum_utime;
    if (info.datum_utime == 0) unit.channel->ClearDatum();
    if (info.datum_utime != 0) unit.channel->SetDatum(info.datum_counts, info.datum_utime);
  }
}

// Another process drives the bus from here on: nothing of the one before counts.
void BusRedecoder::Start(const wire_t& message) {
  Finish();
  boot_id_ = message.boot_id;
  next_seq_ = 0;
  dropped_ = 0;
  now_ = message.mono_ns;
  next_tick_ = now_;
  time_ = Timebase();
  units_.clear();
  for (const DeviceConfig& device : bus_.devices) {
    Unit unit;
    unit.channel = std::make_unique<DevicePublisher>(
        bus_, device,
        DevicePublisherContext{
            .boot_id = message.boot_id, .time = &time_, .sink = &sink_, .on_outcome = {}, .redecoded = true});
    unit.device = bus_.family->make_device(bus_, device, *unit.channel, secrets_);
    units_.push_back(std::move(unit));
  }
}

void BusRedecoder::FollowNumbers(const wire_t& message) {
  const std::int64_t missing = std::max<std::int64_t>(message.seq - next_seq_, 0);
  const std::int64_t unrecorded = std::max<std::int64_t>(message.dropped - dropped_, 0);
  next_seq_ = message.seq + 1;
  dropped_ = message.dropped;
  if (missing > 0 || unrecorded > 0) Interrupt(message, missing, unrecorded);
}

void BusRedecoder::Interrupt(const wire_t& message, std::int64_t messages, std::int64_t records) {
  gaps_.push_back({.utime = message.utime, .messages = messages, .records = records});
  now_ = std::max(now_, message.mono_ns);
  next_tick_ = std::max(next_tick_, now_);
  for (const Event::Kind kind : {Event::Kind::kLinkDown, Event::Kind::kLinkUp}) {
    const bool up = kind == Event::Kind::kLinkUp;
    for (Unit& unit : units_) unit.channel->OnLink(up, up ? std::string_view() : kGapReason, now_);
    for (Unit& unit : units_) unit.device->On(LinkEvent(kind, now_));
  }
}

void BusRedecoder::Deliver(const Event& event) {
  ++events_;
  TickUntil(event.received.last);
  const bool link = event.kind == Event::Kind::kLinkUp || event.kind == Event::Kind::kLinkDown;
  for (std::size_t i = 0; i < units_.size(); ++i) {
    if (link) units_[i].channel->OnLink(event.kind == Event::Kind::kLinkUp, "the line was lost", now_);
    if (event.device < 0 || static_cast<std::size_t>(event.device) == i) units_[i].device->On(event);
  }
}

void BusRedecoder::TickUntil(MonoNs now) {
  if (now <= now_) return;
  recorded_ += now - now_;
  next_tick_ = std::max(next_tick_, now - kMaxTicks);
  for (; next_tick_ <= now; next_tick_ += kTick) {
    for (Unit& unit : units_) unit.channel->Tick(next_tick_);
  }
  now_ = now;
}

void BusRedecoder::Finish() {
  for (Unit& unit : units_) unit.channel->Tick(now_ + kTick);
}

}  // namespace axlecast
