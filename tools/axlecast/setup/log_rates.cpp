#include "tools/axlecast/setup/log_rates.h"

#include <algorithm>
#include <axlecast/alarm_t.hpp>
#include <axlecast/bus_health_t.hpp>
#include <axlecast/device_info_t.hpp>
#include <axlecast/driver_status_t.hpp>
#include <axlecast/exchange_times_t.hpp>
#include <axlecast/motor_health_t.hpp>
#include <axlecast/motor_limits_t.hpp>
#include <axlecast/position_block_t.hpp>
#include <axlecast/position_t.hpp>
#include <axlecast/recorder_health_t.hpp>
#include <axlecast/wire_t.hpp>
#include <string>

#include "tools/log/channel_filter.h"
#include "tools/log/log_event.h"

namespace axlecast {
namespace {

constexpr double kHealthHz = 1;      // DEVICE, ALARM, BUS and their like
constexpr double kBlocksHz = 10;     // POSITION_BLOCK waits for 100 ms: drivers/runtime/axis/device_publisher.h
constexpr double kWireHz = 100;      // WIRE waits for 10 ms: drivers/runtime/bus/wire_log.h
constexpr double kLimitsHz = 0.1;    // LIMITS of a motor
constexpr double kBlockSample = 20;  // bytes of a sample in POSITION_BLOCK
constexpr double kWireRecord = 16;   // bytes of a record in WIRE without its data
constexpr double kRecordsPerExchange = 2;
// Typical bytes of the texts and lists of a message, seen in a log of config/demo.yaml.
constexpr double kDeviceTexts = 240;
constexpr double kBusTexts = 45;
constexpr double kTimesLists = 280;
constexpr double kDriverTexts = 85;
constexpr double kAlarmTexts = 35;
constexpr double kRecorderTexts = 590;

// The growth of one log, channel by channel.
class Growth {
 public:
  Growth(const MachineConfig& machine, const LogConfig& log) : prefix_(machine.lcm.prefix) {
    static_cast<void>(filter_.Set(log.channels, log.invert));  // the loader has checked the expression
  }

  // `Message`s of `more` bytes beyond an empty one.
  template <typename Message>
  void Add(const std::string& channel, double per_second, double more = 0) {
    if (!filter_.Matches(prefix_ + channel)) return;
    const auto record = static_cast<double>(kEventHeader + prefix_.size() + channel.size());
    bytes_ += per_second * (record + static_cast<double>(Message().getEncodedSize()) + more);
  }

  [[nodiscard]] double bytes() const { return bytes_; }

 private:
  const std::string prefix_;
  ChannelFilter filter_;
  double bytes_ = 0;
};

// Returns how often a device is read per second.
double ReadingRate(const BusConfig& bus, const DeviceConfig& device) {
  DeviceConfig unlimited = device;
  unlimited.publish_hz = 1e9;
  return MessageRate(bus, unlimited);
}

// Returns the bytes of one exchange on the wire.
double BytesOnWire(const BusConfig& bus, const DeviceConfig& device) {
  const double seconds = static_cast<double>(device.settings->wire_time) / static_cast<double>(kSecond);
  constexpr double kBitsOfByte = 10;
  constexpr double kFrame = 8;  // bytes, of CAN and SPI
  const bool serial = bus.family->link == LinkKind::kSerial || bus.family->link == LinkKind::kModbus;
  return serial ? seconds * static_cast<double>(bus.link.line.baud) / kBitsOfByte : kFrame;
}

// Returns how many messages with several entries are sent per second: each is sent after its time, which is `hz` times a second
// unless the entries are fewer, or when it is full.
double GroupsPerSecond(double entries, double hz, double full) { return std::max(std::min(hz, entries), full); }

void AddDevice(Growth& growth, const BusConfig& bus, const DeviceConfig& device) {
  growth.Add<device_info_t>("DEVICE/" + device.name, kHealthHz, kDeviceTexts);
  growth.Add<alarm_t>("ALARM/" + device.name, kHealthHz, kAlarmTexts);
  const double readings = ReadingRate(bus, device);
  if (!bus.family->has_position) {
    growth.Add<motor_health_t>("MOTOR/" + device.name, MessageRate(bus, device));
    growth.Add<motor_limits_t>("LIMITS/" + device.name, kLimitsHz);
    return;
  }
  growth.Add<position_t>("POSITION/" + device.name, MessageRate(bus, device));
  if (!device.block) return;
  const double blocks = GroupsPerSecond(readings, kBlocksHz, readings / position_block_t::MAX_SAMPLES);
  growth.Add<position_block_t>("POSITION_BLOCK/" + device.name, blocks, kBlockSample * readings / blocks);
}

void AddWire(Growth& growth, const BusConfig& bus) {
  constexpr double kMostBytes = 1'300;  // drivers/runtime/bus/wire_log.h
  double exchanges = 0;
  double bytes = 0;
  for (const DeviceConfig& device : bus.devices) {
    const double rate = ReadingRate(bus, device);
    exchanges += rate;
    bytes += rate * (BytesOnWire(bus, device) + kRecordsPerExchange * kWireRecord);
  }
  if (exchanges <= 0) return;
  const double messages = GroupsPerSecond(exchanges, kWireHz, bytes / kMostBytes);
  growth.Add<wire_t>("WIRE/" + bus.name, messages, bytes / messages);
}

}  // namespace

double LogBytesPerSecond(const MachineConfig& machine, const LogConfig& log) {
  Growth growth(machine, log);
  for (const BusConfig& bus : machine.buses) {
    for (const DeviceConfig& device : bus.devices) AddDevice(growth, bus, device);
    growth.Add<bus_health_t>("BUS/" + bus.name, kHealthHz, kBusTexts);
    growth.Add<exchange_times_t>("BUS_TIMES/" + bus.name, kHealthHz, kTimesLists);
    growth.Add<driver_status_t>("DRIVER_STATUS/" + bus.name, kHealthHz, kDriverTexts);
    if (bus.capture) AddWire(growth, bus);
  }
  for (const LogConfig& each : machine.recorder.logs) {
    growth.Add<recorder_health_t>("RECORDER/" + each.name, kHealthHz, kRecorderTexts);
  }
  const auto seal = static_cast<double>(kEventHeader + kSealChannel.size() + EncodeSeal({}).size());
  return growth.bytes() + kHealthHz * seal;
}

double QuotaHolds(const LogConfig& log) {
  const auto quota = static_cast<double>(log.quota_bytes);
  if (!log.compress) return quota;
  const auto open = static_cast<double>(SplitBytes(log));  // not compressed yet
  return open + (quota - open) * kCompressionFactor;
}

std::optional<MonoNs> QuotaLasts(const MachineConfig& machine, const LogConfig& log) {
  if (log.quota_bytes == 0 || !log.trigger.empty()) return std::nullopt;
  return static_cast<MonoNs>(QuotaHolds(log) / LogBytesPerSecond(machine, log) * static_cast<double>(kSecond));
}

}  // namespace axlecast
