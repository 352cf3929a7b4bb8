#include "tools/redecode/log_redecoder.h"

#include <cstdio>
#include <utility>

#include "core/messages/message.h"

namespace axlecast {
namespace {

constexpr std::string_view kWire = "WIRE/";
constexpr std::string_view kDevice = "DEVICE/";

bool IsReading(std::string_view channel) {
  return channel.starts_with("POSITION/") || channel.starts_with("MOTOR/");
}

using Json = nlohmann::ordered_json;

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
      fields[field.name] = {{"recorded", Json::parse(field.recorded)}, {"redecoded", Json::parse(field.redecoded)}};
    }
    differences.push_back({{"mono_ns", difference.mono_ns}, {"fields", fields}});
  }
  return differences;
}

std::string BusLine(const std::string& name, const BusRedecoder& bus) {
  char seconds[32];
  static_cast<void>(std::snprintf(seconds, sizeof seconds, "%.1f", static_cast<double>(bus.recorded()) / 1e9));
  return name + ": " + std::to_string(bus.messages()) + " messages, " + std::to_string(bus.events()) + " events, " +
         seconds + " s, " + std::to_string(bus.gaps().size()) + " gaps, " + std::to_string(bus.unreadable()) +
         " unreadable\n";
}

std::string GapLine(const BusRedecoder::Gap& gap) {
  const std::string what = gap.messages > 0 ? std::to_string(gap.messages) + " messages missing"
                                            : std::to_string(gap.records) + " records not recorded by the driver";
  return "  gap before " + std::to_string(gap.utime) + " us: " + what +
         "; what follows starts anew, as after a pulled cable\n";
}

std::string TallyText(const std::string& channel, const RecordingDiff::Tally& tally) {
  std::string text = channel + ": " + std::to_string(tally.equal) + " equal, " + std::to_string(tally.differing) +
                     " differ, " + std::to_string(tally.only_recorded) + " only recorded, " +
                     std::to_string(tally.only_redecoded) + " only decoded again\n";
  for (const RecordingDiff::Difference& difference : tally.first) {
    text += "  at mono_ns " + std::to_string(difference.mono_ns) + ':';
    for (const RecordingDiff::Field& field : difference.fields) {
      text += ' ' + field.name + ' ' + field.recorded + " -> " + field.redecoded;
    }
    text += '\n';
  }
  return text;
}

}  // namespace

LogRedecoder::LogRedecoder(const MachineConfig& machine, std::string_view only_bus, Output output)
    : machine_(machine), only_bus_(only_bus), output_(std::move(output)), speech_(*this) {}

void LogRedecoder::On(const LogEvent& event) {
  if (!event.channel.starts_with(machine_.lcm.prefix)) return;
  const std::string_view channel = event.channel.substr(machine_.lcm.prefix.size());
  utime_ = event.utime;
  if (channel.starts_with(kWire)) {
    OnWire(channel.substr(kWire.size()), event.data);
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
  if (!IsWanted(config)) return;
  const auto message = DecodeMessage<wire_t>(data);
  if (!message) {
    ++malformed_;
    return;
  }
  std::unique_ptr<BusRedecoder>& redecoder = buses_[config->name];
  if (redecoder == nullptr) redecoder = std::make_unique<BusRedecoder>(*config, speech_);
  redecoder->On(*message);
}

void LogRedecoder::OnSpoken(const std::string& channel, Bytes message) {
  if (IsReading(channel)) diff_.OnRedecoded(channel, message);
  const std::string whole = machine_.lcm.prefix + channel;
  if (output_) output_({.number = number_++, .utime = utime_, .channel = whole, .data = message});
}

void LogRedecoder::Finish() {
  for (const auto& [name, bus] : buses_) bus->Finish();
  diff_.Finish();
}

bool LogRedecoder::IsWanted(const BusConfig* bus) const {
  return bus != nullptr && (only_bus_.empty() || only_bus_ == bus->name);
}

// Readings of a bus that is not captured have nothing to be compared with. The first ones of a captured bus stand
// before its first WIRE message.
bool LogRedecoder::IsCaptured(std::string_view device) const {
  const BusConfig* const bus = machine_.BusOf(device);
  return IsWanted(bus) && (bus->capture || buses_.contains(bus->name));
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
