#include "drivers/saa_modbus/settings.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"
#include "core/device/operation.h"
#include "drivers/saa/data_sheet.h"
#include "drivers/saa_modbus/codec.h"

namespace axlecast::saa_modbus {
namespace {

constexpr MonoNs kFixedInterval = 1'750 * kMicrosecond;
constexpr std::int64_t kFastestCounted = 19'200;
constexpr std::size_t kReadCharacters = 8;
constexpr std::size_t kReplyCharacters = 9;

// The encoder's own time is not documented; a USB adapter's latency timer takes 16 ms by default.
constexpr MonoNs kPatience = 50 * kMillisecond;
constexpr double kStandstillDeg = 0.1;
constexpr std::int64_t kMaxUs = 10'000'000;

void ParseTimes(ConfigMap& device, const LineFormat& line, SaaModbusSettings& settings) {
  const MonoNs usual = LongestExchange(line) + kPatience;
  const MonoNs minimum = LongestExchange(line);
  settings.timeout = device.Integer("timeout_us", usual / kMicrosecond, minimum / kMicrosecond, kMaxUs,
                                    "us, longer than one exchange at this baud rate and the adapter's latency") *
                     kMicrosecond;
  settings.reply_timeout = settings.timeout;
  settings.write_interval = device.Integer("write_interval_s", 10, 1, 86'400, "s") * kSecond;
}

}  // namespace

MonoNs SilentInterval(const LineFormat& line) {
  if (line.baud > kFastestCounted) return kFixedInterval;
  return (line.WireTime(7) + 1) / 2;
}

MonoNs LongestExchange(const LineFormat& line) {
  return line.WireTime(kReadCharacters + kReplyCharacters) + SilentInterval(line);
}

std::int64_t ZeroToleranceCounts(int bits) {
  const double counts = std::ldexp(kStandstillDeg / 360.0, bits);
  return std::max<std::int64_t>(2, std::llround(counts)) + saa::NoiseCounts(bits);
}

std::string PositionText(std::int64_t counts, int bits) {
  return Text("counts %lld, %.4f deg", static_cast<long long>(counts), Degrees(counts, bits));
}

std::shared_ptr<const FamilyBus> ParseBus(ConfigMap& map, const BusConfig& bus) {
  ConfigMap link = map.Map("link");
  if (!BaudParameter(bus.link.line.baud)) {
    link.Error("baud", std::to_string(bus.link.line.baud) +
                           " is no rate of these encoders: 2400, 4800, 9600, 19200 (as delivered) or 57600");
  }
  auto family_bus = std::make_shared<FamilyBus>();
  const MonoNs interval = SilentInterval(bus.link.line);
  family_bus->pacing.after_request = interval;
  family_bus->pacing.after_reply = interval;
  return family_bus;
}

std::unique_ptr<DeviceSettings> ParseSettings(ConfigMap& device, const BusConfig& bus) {
  auto settings = std::make_unique<SaaModbusSettings>();
  settings->model = saa::kModels.at(device.Choice("model", {saa::kModels.begin(), saa::kModels.end()}, 0));
  device.Require("bits", "the encoder's resolution, 10 to 26 bits");
  settings->bits = static_cast<int>(device.Integer("bits", kOneRegisterBits, kMinBits, kMaxBits, "bits"));
  const int needed = settings->bits <= kOneRegisterBits ? 1 : 2;
  settings->registers = static_cast<int>(device.Integer("registers", needed, 1, 2, "registers"));
  if (settings->registers < needed) {
    device.Error("registers", "1 holds up to 16 bits: " + std::to_string(settings->bits) + " bits need 2");
  }
  settings->address =
      static_cast<std::uint8_t>(device.Integer("address", kMinAddress, kMinAddress, kMaxAddress, ""));
  settings->counts_per_turn = std::int64_t{1} << settings->bits;
  settings->max_speed_rpm = saa::kMaxSpeedRpm;
  settings->noise_counts = saa::NoiseCounts(settings->bits);
  ParseTimes(device, bus.link.line, *settings);
  const LineFormat& line = bus.link.line;
  const std::size_t reply = 5 + 2 * static_cast<std::size_t>(settings->registers);
  settings->wire_time = line.WireTime(kReadCharacters + reply) + 2 * SilentInterval(line);
  // Its reply begins after a silent interval at the earliest (Modbus over serial line 2.5.1.1).
  settings->latch_after = line.WireTime(kReadCharacters) + SilentInterval(line) / 2;
  return settings;
}

void CheckBus(ConfigMap& map, const BusConfig& bus) {
  std::map<std::uint8_t, std::string> taken;
  ConfigMap devices = map.Map("devices");
  for (const DeviceConfig& device : bus.devices) {
    const auto& settings = static_cast<const SaaModbusSettings&>(*device.settings);
    const auto [first, added] = taken.emplace(settings.address, device.name);
    if (added) continue;
    devices.Error(device.name, "address " + std::to_string(settings.address) + " is that of " + first->second +
                                   " too: each encoder needs its own (delivered with 1; operation set_address, "
                                   "one encoder connected at a time)");
  }
}

}  // namespace axlecast::saa_modbus
