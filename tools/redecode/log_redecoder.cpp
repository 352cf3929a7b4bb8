#include "tools/redecode/log_redecoder.h"

#include <algorithm>
#include <axlecast/motor_health_t.hpp>
#include <axlecast/position_t.hpp>

#include "core/base/text.h"
#include "core/messages/json/message_json.h"

namespace axlecast {
namespace {

// Returns the sampling time and the message without the fields that must differ.
template <typename Message>
std::optional<std::pair<MonoNs, std::vector<std::uint8_t>>> Comparable(Bytes bytes) {
  std::optional<Message> message = DecodeMessage<Message>(bytes);
  if (!message) return std::nullopt;
  message->seq = 0;
  if constexpr (std::is_same_v<Message, position_t>) message->tick = 0;
  message->flags &= ~Message::FLAG_REDECODED;
  return std::pair(message->mono_ns, Encoded(*message));
}

using Json = nlohmann::ordered_json;

constexpr MonoNs kTick = 100 * kMillisecond;  // of a driver's channels
constexpr MonoNs kLatest = kNever / 2;
// A longer silence is skipped: by then, every device has published its silence.
constexpr MonoNs kMaxTicks = 60 * kSecond;
constexpr std::string_view kGapReason = "the recording has a gap here";

// Returns true if a driver can have sent the numbers. Calculations with them cannot overflow.
bool IsInRange(const wire_t& message) {
  const auto within = [](std::int64_t value, std::int64_t maximum) { return value >= 0 && value <= maximum; };
  return within(message.mono_ns, kLatest) && within(message.utime, kLatest / kMicrosecond) &&
         within(message.seq, kLatest) && within(message.dropped, kLatest);
}

Event LinkEvent(Event::Kind kind, MonoNs now) {
  return {.kind = kind, .sent = {}, .received = {now, now}, .request = {}, .bytes = {}};
}

constexpr std::string_view kWire = "WIRE/";
constexpr std::string_view kDevice = "DEVICE/";
constexpr std::string_view kTime = "TIME/";

bool IsReading(std::string_view channel) {
  return channel.starts_with("POSITION/") || channel.starts_with("MOTOR/");
}

Json GapsOf(const BusRedecoder& bus) {
  Json gaps = Json::array();
  for (const BusRedecoder::Gap& gap : bus.gaps()) {
    gaps.push_back({{"utime", gap.utime}, {"messages", gap.messages}, {"records", gap.records}});
  }
  return gaps;
}

Json DifferencesOf(const RecordingDiff::Tally& tally) {
  Json differences = Json::array();
  for (const RecordingDiff::Difference& difference : tally.first) {
    Json fields = Json::object();
    for (const RecordingDiff::Field& field : difference.fields) {
      fields[field.name] = {{"recorded", field.recorded}, {"redecoded", field.redecoded}};
    }
    differences.push_back({{"mono_ns", difference.mono_ns}, {"fields", fields}});
  }
  return differences;
}

std::string BusLine(const std::string& name, const BusRedecoder& bus) {
  return name + ": " + std::to_string(bus.messages()) + " messages, " + std::to_string(bus.events()) + " events, " +
         Decimal(static_cast<double>(bus.recorded()) / 1e9, 1) + " s, " + std::to_string(bus.gaps().size()) +
         " gaps, " + std::to_string(bus.unreadable()) + " unreadable\n";
}

std::string GapLine(const BusRedecoder::Gap& gap) {
  const std::string what = gap.messages > 0 ? std::to_string(gap.messages) + " messages missing"
                                            : std::to_string(gap.records) + " records not recorded by the driver";
  return "  gap before " + std::to_string(gap.utime) + " us: " + what +
         "; decoding restarts after it, as after a pulled cable\n";
}

std::string TallyText(const std::string& channel, const RecordingDiff::Tally& tally) {
  std::string text = channel + ": " + std::to_string(tally.equal) + " equal, " + std::to_string(tally.differing) +
                     " differ, " + std::to_string(tally.only_recorded) + " only recorded, " +
                     std::to_string(tally.only_redecoded) + " only decoded again\n";
  for (const RecordingDiff::Difference& difference : tally.first) {
    text += "  at mono_ns " + std::to_string(difference.mono_ns) + ':';
    for (const RecordingDiff::Field& field : difference.fields) {
      text += ' ' + field.name + ' ' + field.recorded.dump() + " -> " + field.redecoded.dump();
    }
    text += '\n';
  }
  return text;
}

}  // namespace

void RecordingDiff::Add(const std::string& channel, Bytes message, Side side) {
  auto comparable = Comparable<position_t>(message);
  if (!comparable) comparable = Comparable<motor_health_t>(message);
  if (!comparable) return;
  Waiting& waiting = waiting_[channel];
  waiting[side].push_back({comparable->first, std::move(comparable->second)});
  Match(waiting, tallies_[channel]);
}

// If one side has passed a time, the other side has no reading of that time.
void RecordingDiff::Match(Waiting& waiting, Tally& tally) {
  auto& [recorded, redecoded] = waiting;
  while (!recorded.empty() && !redecoded.empty()) {
    const MonoNs apart = recorded.front().mono_ns - redecoded.front().mono_ns;
    if (apart < 0) ++tally.only_recorded;
    if (apart > 0) ++tally.only_redecoded;
    if (apart == 0) Compare(recorded.front(), redecoded.front(), tally);
    if (apart <= 0) recorded.pop_front();
    if (apart >= 0) redecoded.pop_front();
  }
}

void RecordingDiff::Compare(const Reading& recorded, const Reading& redecoded, Tally& tally) {
  if (recorded.message == redecoded.message) {
    ++tally.equal;
    return;
  }
  ++tally.differing;
  if (tally.first.size() >= kShown) return;
  Difference difference{.mono_ns = recorded.mono_ns, .fields = {}};
  std::string type;
  const auto before = DecodeToJson(recorded.message, &type);
  const auto after = DecodeToJson(redecoded.message, &type);
  for (const auto& [name, value] : before->items()) {
    if (after->at(name) != value) difference.fields.push_back({name, value, after->at(name)});
  }
  tally.first.push_back(std::move(difference));
}

void RecordingDiff::Finish() {
  for (auto& [channel, waiting] : waiting_) {
    tallies_[channel].only_recorded += static_cast<std::int64_t>(waiting[kRecorded].size());
    tallies_[channel].only_redecoded += static_cast<std::int64_t>(waiting[kRedecoded].size());
  }
  waiting_.clear();
}

bool RecordingDiff::same() const {
  return std::all_of(tallies_.begin(), tallies_.end(), [](const auto& tally) { return tally.second.same(); });
}

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
  CheckNumbers(message);
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

// Begins the recording of another driver process: all state of the previous one is discarded.
void BusRedecoder::Start(const wire_t& message) {
  Finish();
  boot_id_ = message.boot_id;
  next_seq_ = 0;
  dropped_ = 0;
  now_ = message.mono_ns;
  next_tick_ = now_;
  time_ = Timebase();
  base_.emplace(message.clock_id);
  units_.clear();
  for (const DeviceConfig& device : bus_.devices) {
    Unit unit;
    unit.channel = std::make_unique<DevicePublisher>(
        bus_, device,
        DevicePublisherContext{
            .origin = {.boot_id = message.boot_id, .machine_id = message.machine_id, .clock_id = message.clock_id},
            .time = &time_,
            .sink = &sink_,
            .on_outcome = {},
            .redecoded = true});
    unit.device = bus_.family->make_device(bus_, device, *unit.channel, secrets_);
    units_.push_back(std::move(unit));
  }
}

void BusRedecoder::CheckNumbers(const wire_t& message) {
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

// Returns the tick of the slot in which a request was sent at `sent`; kNoTick if it is not known.
std::int64_t BusRedecoder::TickOf(MonoNs sent) const {
  if (ticks_.period <= 0) return kNoTick;
  if (!has_time_base_) return (sent + ticks_.lead - ticks_.phase) / ticks_.period;
  // Slots that follow the base may begin a quarter of the period before its tick.
  const MonoNs early = ticks_.period / 4;
  const auto claim = base_->At(sent);
  if (!claim || claim->half_width_ns > early) return kNoTick;
  return (claim->base_ns + ticks_.lead - ticks_.phase + early) / ticks_.period;
}

void BusRedecoder::Deliver(const Event& event) {
  ++events_;
  TickUntil(event.received.last);
  const bool request = event.kind == Event::Kind::kReply || event.kind == Event::Kind::kTimeout;
  if (request || event.kind == Event::Kind::kSent) {
    const std::int64_t tick = TickOf(request ? event.sent.first : event.received.first);
    for (std::size_t i = 0; i < units_.size(); ++i) {
      const bool own = event.device < 0 || static_cast<std::size_t>(event.device) == i;
      if (own && IsReadOnTicks(bus_, bus_.devices[i])) units_[i].channel->OnTick(tick);
    }
  }
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

void LogRedecoder::On(const LogEvent& event) {
  if (!event.channel.starts_with(machine_.lcm.prefix)) return;
  const std::string_view channel = event.channel.substr(machine_.lcm.prefix.size());
  utime_ = event.utime;
  if (channel.starts_with(kWire)) {
    OnWire(channel.substr(kWire.size()), event.data);
  } else if (channel.starts_with(kTime)) {
    for (const auto& [name, bus] : buses_) bus->OnTime(event.data);
  } else if (channel.starts_with(kDevice)) {
    if (const auto info = DecodeMessage<device_info_t>(event.data)) {
      for (const auto& [name, bus] : buses_) bus->OnDeviceInfo(*info);
    }
  } else if (IsReading(channel) && IsCaptured(channel.substr(channel.find('/') + 1))) {
    diff_.OnRecorded(std::string(channel), event.data);
  }
}

void LogRedecoder::OnWire(std::string_view bus, Bytes data) {
  const BusConfig* const config = machine_.FindBus(bus);
  if (!IsSelected(config)) return;
  const auto message = DecodeMessage<wire_t>(data);
  if (!message) {
    ++malformed_;
    return;
  }
  std::unique_ptr<BusRedecoder>& redecoder = buses_[config->name];
  if (redecoder == nullptr)
    redecoder =
        std::make_unique<BusRedecoder>(*config, !machine_.time.root.empty(), static_cast<MessageSink&>(*this));
  redecoder->On(*message);
}

void LogRedecoder::Publish(const std::string& channel, Bytes message) {
  if (IsReading(channel)) diff_.OnRedecoded(channel, message);
  const std::string whole = machine_.lcm.prefix + channel;
  if (output_) output_({.utime = utime_, .channel = whole, .data = message});
}

void LogRedecoder::Finish() {
  for (const auto& [name, bus] : buses_) bus->Finish();
  diff_.Finish();
}

bool LogRedecoder::IsSelected(const BusConfig* bus) const {
  return bus != nullptr && (only_bus_.empty() || only_bus_ == bus->name);
}

// Readings of a bus without capture cannot be compared. The first readings of a captured bus are before its first WIRE message.
bool LogRedecoder::IsCaptured(std::string_view device) const {
  const BusConfig* const bus = machine_.BusOf(device);
  return IsSelected(bus) && (bus->capture || buses_.contains(bus->name));
}

Json ToJson(const LogRedecoder& redecoder, bool diff) {
  Json json{{"malformed", redecoder.malformed()}, {"buses", Json::array()}};
  for (const auto& [name, bus] : redecoder.buses()) {
    json["buses"].push_back({{"bus", name},
                             {"messages", bus->messages()},
                             {"events", bus->events()},
                             {"recorded_ns", bus->recorded()},
                             {"unreadable", bus->unreadable()},
                             {"gaps", GapsOf(*bus)}});
  }
  if (!diff) return json;
  json["same"] = redecoder.diff().same();
  json["channels"] = Json::array();
  for (const auto& [channel, tally] : redecoder.diff().tallies()) {
    json["channels"].push_back({{"channel", channel},
                                {"equal", tally.equal},
                                {"differing", tally.differing},
                                {"only_recorded", tally.only_recorded},
                                {"only_redecoded", tally.only_redecoded},
                                {"first", DifferencesOf(tally)}});
  }
  return json;
}

std::string ToText(const LogRedecoder& redecoder, bool diff) {
  std::string text;
  if (redecoder.malformed() > 0)
    text += std::to_string(redecoder.malformed()) + " messages on WIRE are malformed\n";
  for (const auto& [name, bus] : redecoder.buses()) {
    text += BusLine(name, *bus);
    for (const BusRedecoder::Gap& gap : bus->gaps()) text += GapLine(gap);
  }
  if (!diff) return text;
  for (const auto& [channel, tally] : redecoder.diff().tallies()) text += TallyText(channel, tally);
  return text;
}

}  // namespace axlecast
