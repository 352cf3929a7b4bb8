#include "tools/redecode/log_redecoder.h"

#include <utility>

#include "core/messages/message.h"

namespace axlecast {
namespace {

constexpr std::string_view kWire = "WIRE/";
constexpr std::string_view kDevice = "DEVICE/";

bool IsReading(std::string_view channel) {
  return channel.starts_with("POSITION/") || channel.starts_with("MOTOR/");
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

}  // namespace axlecast
