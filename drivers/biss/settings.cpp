#include "drivers/biss/settings.h"

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "core/config/config_map.h"
#include "core/device/operation.h"
#include "drivers/saa/data_sheet.h"

namespace axlecast::biss {
namespace {

// Data change on rising edges of the clock, which idles high (5.6). Mode 2 (CPOL 1, CPHA 0) samples on the falling
// edge half a cycle later, and takes its first sample at the falling edge before the first rising one. Mode 3 (CPOL 1,
// CPHA 1) samples on the rising edges: the level that the rising edge before has made. It is for lines whose delay
// puts the changes onto the falling edges.
constexpr int kSampleOnFalling = 2;
constexpr int kSampleOnRising = 3;

constexpr std::int64_t kDefaultLineDelayNs = 500;
constexpr std::int64_t kMaxLineDelayNs = 20'000;
constexpr std::int64_t kDefaultBusyUs = 10;
constexpr std::int64_t kMaxBusyUs = 150;
constexpr std::int64_t kDefaultJitterUs = 1;

constexpr std::string_view kCustom = "custom";

// kCustom is the last.
const std::vector<std::string_view>& Models() {
  static const std::vector<std::string_view> kModels = [] {
    std::vector<std::string_view> models(saa::kModels.begin(), saa::kModels.end());
    models.push_back(kCustom);
    return models;
  }();
  return kModels;
}

// Clocks that are not over before so much time has passed.
std::int64_t ClocksIn(MonoNs time, std::int64_t clock_hz) { return (time * clock_hz + kSecond - 1) / kSecond; }

std::int64_t ClockOf(const BusConfig& bus) { return bus.link.clock_hz == 0 ? kDefaultClockHz : bus.link.clock_hz; }

void CheckClock(ConfigMap& map, const BusConfig& bus, MonoNs timeout) {
  ConfigMap link = map.Map("link");
  const std::int64_t clock = ClockOf(bus);
  const std::int64_t minimum = kSecond / timeout + 1;
  if (clock >= kTooFastHz) {
    link.Error("clock_hz", std::to_string(clock) +
                               " Hz: a cycle must be longer than 100 ns (SAA manual 5.6, TMAS), below " +
                               std::to_string(kTooFastHz) + " Hz");
  } else if (clock < minimum) {
    link.Error("clock_hz", std::to_string(clock) + " Hz: a cycle would be as long as timeout_us, after which the " +
                               "encoder takes the frame for ended; " + std::to_string(minimum) + " Hz at least");
  }
}

void ParseModel(ConfigMap& device, BissSettings& settings) {
  settings.model = Models()[device.Choice("model", Models(), 0)];
  const bool custom = settings.model == kCustom;
  const int maximum = custom ? kMaxBits : saa::kMaxBits;
  if (!device.Has("bits")) {
    device.Error("bits",
                 Text("is missing: the resolution, %d to %d, as on the encoder's label", kMinBits, maximum));
  }
  settings.format.bits = static_cast<int>(device.Integer("bits", 16, kMinBits, maximum, "bits"));
  settings.format.turn_bits = static_cast<int>(device.Integer("turn_bits", 0, 0, kMaxTurnBits, "bits"));
  if (settings.format.bits + settings.format.turn_bits > kMaxPositionBits) {
    device.Error("turn_bits", Text("%d and bits %d are more than %d: counts would not be exact",
                                   settings.format.turn_bits, settings.format.bits, kMaxPositionBits));
  }
  settings.max_speed_rpm = saa::kMaxSpeedRpm;
  settings.noise_counts = saa::NoiseCounts(settings.format.bits);
  for (const char* key : {"max_speed_rpm", "noise_counts"}) {
    if (!custom && device.Has(key)) device.Error(key, "is known of SAA encoders: only model custom takes it");
  }
  if (!custom) return;
  if (!device.Has("max_speed_rpm")) {
    device.Error("max_speed_rpm", "is missing: the fastest that the encoder may turn, from its data sheet");
  }
  settings.max_speed_rpm = device.Number("max_speed_rpm", saa::kMaxSpeedRpm, 0.001, 1e6, "rpm");
  settings.noise_counts = device.Integer("noise_counts", settings.noise_counts, 0, 1'000'000'000, "counts");
}

void ParseCrc(ConfigMap& device, CrcRule& rule) {
  ConfigMap map = device.Map("crc");
  rule.bits = static_cast<int>(map.Integer("bits", rule.bits, kMinCrcBits, kMaxCrcBits, "bits"));
  if (rule.bits != CrcRule().bits && !map.Has("poly")) {
    map.Error("poly", "is missing: the usual one has 6 bits, x^6 + x + 1 = 0x43");
  }
  const std::int64_t given = map.Integer("poly", rule.polynomial, 1, 0x1FFFF, "e.g. 0x43: x^6 + x + 1");
  rule.polynomial = Polynomial(given, rule.bits);
  if (map.Has("poly") && rule.polynomial == 0) {
    map.Error("poly",
              Text("0x%llX is no polynomial of %d bits that ends with + 1: 0x43 is x^6 + x + 1, and so is 0x03",
                   static_cast<unsigned long long>(given), rule.bits));
  }
  if (rule.polynomial == 0) rule = CrcRule();
  const std::int64_t maximum = (std::int64_t{1} << static_cast<unsigned>(rule.bits)) - 1;
  rule.start =
      static_cast<std::uint32_t>(map.Integer("start", 0, 0, maximum, "the register's content at the start"));
  rule.inverted = map.Bool("inverted", true);
  map.Done();
}

}  // namespace

Reach ReachOf(const SpiSettings& spi, MonoNs line_delay, MonoNs busy, const Format& format) {
  // The second rising edge, which acknowledges, is one and a half cycles after the first falling one. At no delay its
  // effect is sample 2 in both modes.
  const std::int64_t latest_ack = 2 + ClocksIn(line_delay, spi.clock_hz);
  // The start bit comes with a clock: the next one after the encoder is ready.
  const std::int64_t busy_clocks = std::max(kMinBusyClocks, ClocksIn(busy, spi.clock_hz)) + 1;
  Reach reach;
  reach.search.latest_ack = static_cast<std::size_t>(latest_ack);
  reach.search.latest_start = static_cast<std::size_t>(latest_ack + busy_clocks);
  const std::size_t clocks = reach.search.latest_start + 2 + static_cast<std::size_t>(FrameBits(format));
  reach.bytes = (clocks + 7) / 8;
  return reach;
}

std::uint32_t Polynomial(std::int64_t given, int bits) {
  const std::int64_t highest = std::int64_t{1} << static_cast<unsigned>(bits);
  if (given <= 0 || given >= 2 * highest || given % 2 == 0) return 0;
  return static_cast<std::uint32_t>(given | highest);
}

std::shared_ptr<const FamilyBus> ParseBus(ConfigMap& map, const BusConfig& bus) {
  auto own = std::make_shared<BissBus>();
  own->timeout =
      map.Integer("timeout_us", kTimeoutUs, 1, 1'000, "us, after which the encoder ends a frame") * kMicrosecond;
  own->line_delay = map.Integer("line_delay_ns", kDefaultLineDelayNs, 0, kMaxLineDelayNs,
                                "ns, there and back, drivers and cable");
  own->spi_mode = map.Choice("sample_on", {"falling", "rising"}, 0) == 0 ? kSampleOnFalling : kSampleOnRising;
  own->pacing.after_reply = own->timeout + own->timeout / 4 + own->line_delay;
  CheckClock(map, bus, own->timeout);
  return own;
}

std::unique_ptr<DeviceSettings> ParseDevice(ConfigMap& device, const BusConfig& bus) {
  const BissBus& own = OwnBus(bus);
  auto settings = std::make_unique<BissSettings>();
  ParseModel(device, *settings);
  ParseCrc(device, settings->format.crc);
  settings->counts_per_turn = std::int64_t{1} << static_cast<unsigned>(settings->format.bits);
  const int turn_bits = settings->format.turn_bits;
  settings->turns_range = turn_bits == 0 ? 0 : std::int64_t{1} << static_cast<unsigned>(turn_bits);
  settings->spi = {.mode = own.spi_mode, .clock_hz = std::min(ClockOf(bus), kTooFastHz - 1)};
  const MonoNs busy =
      device.Integer("busy_us", kDefaultBusyUs, 0, kMaxBusyUs, "us, the longest time to prepare a frame") *
      kMicrosecond;
  const MonoNs jitter = device.Integer("busy_jitter_us", kDefaultJitterUs, 0, kMaxBusyUs,
                                       "us, by which that time differs from one frame to the next") *
                        kMicrosecond;
  settings->start_jitter =
      static_cast<std::size_t>(std::max<std::int64_t>(1, ClocksIn(jitter, settings->spi.clock_hz)));
  const Reach reach = ReachOf(settings->spi, own.line_delay, busy, settings->format);
  settings->search = reach.search;
  settings->transfer_bytes = reach.bytes;
  const auto clocks = static_cast<std::int64_t>(8 * reach.bytes);
  settings->wire_time = settings->spi.ClockTime(clocks) + own.pacing.after_reply;
  return settings;
}

const BissBus& OwnBus(const BusConfig& bus) { return static_cast<const BissBus&>(*bus.family_bus); }
const BissSettings& Own(const DeviceConfig& device) { return static_cast<const BissSettings&>(*device.settings); }

}  // namespace axlecast::biss
