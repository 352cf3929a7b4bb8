#include "drivers/saa_can/settings.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/config/config_map.h"
#include "core/device/operation.h"
#include "drivers/cia406/cia406.h"
#include "drivers/saa/data_sheet.h"

namespace axlecast::saa_can {
namespace {

// cia406 is the last.
const std::vector<std::string_view>& Models() {
  static const std::vector<std::string_view> kModels = [] {
    std::vector<std::string_view> models(saa::kModels.begin(), saa::kModels.end());
    models.push_back(cia406::kModel);
    return models;
  }();
  return kModels;
}

constexpr std::int64_t kMaxPeriodMs = 1'000;  // TT is a whole number a second
constexpr std::int64_t kDefaultTimeoutUs = 20'000;
constexpr std::int64_t kDefaultLatencyUs = 5'000;
// Generous: the only cost is a missing reading at exactly the position that looks like the reply.
constexpr std::int64_t kDefaultReplyMs = 1'000;
constexpr std::int64_t kDefaultSettleMs = 100;
constexpr double kZeroToleranceDeg = 0.2;

void ParsePeriod(ConfigMap& device, SaaCanSettings& settings) {
  if (settings.mode == Mode::kSingle) {
    for (const char* key : {"period_ms", "set_period"}) {
      if (device.Has(key))
        device.Error(key, "is of mode cyclic only: in mode single, poll_hz of the bus sets the rate");
    }
    return;
  }
  const std::int64_t period_ms =
      device.Integer("period_ms", kFactoryPeriodMs, 1, kMaxPeriodMs, "ms, as the encoder is set");
  settings.period = period_ms * kMillisecond;
  if (!device.Bool("set_period", false)) return;
  settings.set_per_second = PerSecond(period_ms);
  if (!settings.set_per_second) {
    device.Error("period_ms",
                 "with set_period it must be 1000 divided by 1 to 255: 4, 5, 8, 10, 20, 25, 40, 50, "
                 "100, 125, 200, 250, 500 or 1000 ms");
  }
}

// Reads the bytes that the manual leaves out where it prints two commands alike.
void ParseUnprinted(ConfigMap& device, SaaCanSettings& settings) {
  const auto byte = [&](const char* key) -> std::optional<std::uint8_t> {
    if (!device.Has(key)) return std::nullopt;
    return static_cast<std::uint8_t>(device.Integer(key, 0, 0, 0xFF, "(the third byte of the command)"));
  };
  settings.positive_byte = byte("positive_byte");
  settings.negative_byte = byte("negative_byte");
  settings.stop_byte = byte("stop_byte");
  if (settings.positive_byte && settings.positive_byte == settings.negative_byte) {
    device.Error("negative_byte", "is that of positive_byte: the two directions need two bytes; ask the maker");
  }
}

void ParseTimes(ConfigMap& device, SaaCanSettings& settings) {
  if (settings.mode == Mode::kCyclic && device.Has("timeout_us")) {
    device.Error("timeout_us", "is of mode single only: in mode cyclic three periods without a frame are silence");
  }
  settings.timeout = device.Integer("timeout_us", kDefaultTimeoutUs, 100, 1'000'000, "us") * kMicrosecond;
  settings.latency =
      device.Integer("latency_us", kDefaultLatencyUs, 0, 1'000'000, "us, from sampling to the frame's first bit") *
      kMicrosecond;
  settings.reply_window = device.Integer("reply_ms", kDefaultReplyMs, 10, 60'000, "ms") * kMillisecond;
  settings.zero_settle = device.Integer("zero_settle_ms", kDefaultSettleMs, 1, 10'000, "ms") * kMillisecond;
}

// 1NN: positions and replies. 2NN: own commands, once they were on the bus, and those of other masters, whose replies must
// not be taken for positions either. A bench receives everything: other nodes on the bus decide what is allowed.
CanFilters FiltersOf(std::uint8_t node, bool bench) {
  if (bench) return {{.id = 0, .mask = 0}};
  return {OnlyStandard(DataId(node)), OnlyStandard(RequestId(node)), OnlyStandard(kConfigureId),
          OnlyStandard(kConfigureReplyId)};
}

std::unique_ptr<DeviceSettings> ParseOwn(ConfigMap& device, const BusConfig& bus) {
  auto settings = std::make_unique<SaaCanSettings>();
  settings->model = Models()[device.Choice("model", Models(), 0)];
  device.Require("bits", "the resolution, 10 to 26, as on the encoder's label");
  settings->format.bits = static_cast<int>(device.Integer("bits", 14, kMinBits, kMaxBits, "bits"));
  settings->format.big_endian = device.Choice("byte_order", {"little", "big"}, 0) == 1;
  settings->node =
      static_cast<std::uint8_t>(device.Integer("node", kFactoryNode, kMinNode, kMaxNode, "(NN, 0x01 to 0xff)"));
  settings->mode = static_cast<Mode>(device.Choice("mode", {"cyclic", "single"}, 0));
  settings->start = device.Bool("start", true);
  ParsePeriod(device, *settings);
  ParseUnprinted(device, *settings);
  ParseTimes(device, *settings);
  if (settings->mode == Mode::kSingle) settings->reply_timeout = settings->timeout;
  settings->counts_per_turn = std::int64_t{1} << settings->format.bits;
  settings->max_speed_rpm = saa::kMaxSpeedRpm;
  settings->noise_counts = saa::NoiseCounts(settings->format.bits);
  settings->own_period = settings->period;
  const CanFrameTime wire{bus.link.bitrate};
  settings->wire_time = wire.Longest(kSentSize) * (settings->mode == Mode::kSingle ? 2 : 1);
  settings->latch_after = wire.Longest(kSentSize);  // `80 NN`; how long it then takes is stated nowhere
  if (!bus.simulate) settings->wire = wire;         // a simulated one can be faster than any
  settings->can_filters = FiltersOf(settings->node, OwnBus(bus).bench);
  settings->wire_bitrate = bus.link.bitrate;
  settings->iface = bus.simulate ? bus.name : bus.link.port;
  return settings;
}

bool Uses(const DeviceConfig& device, std::uint32_t id) {
  if (cia406::IsOwn(device)) return cia406::UsesId(device, id);
  const std::uint8_t node = Own(device).node;
  return id == DataId(node) || id == RequestId(node) || id == kConfigureId || id == kConfigureReplyId;
}

// Reports a pair of SAA encoders once.
void CheckIds(ConfigMap& map, const BusConfig& bus) {
  ConfigMap devices = map.Map("devices");
  for (auto first = bus.devices.begin(); first != bus.devices.end(); ++first) {
    if (cia406::IsOwn(*first)) continue;
    const std::uint8_t node = Own(*first).node;
    for (auto other = bus.devices.begin(); other != bus.devices.end(); ++other) {
      if (other == first || (other < first && !cia406::IsOwn(*other))) continue;
      const std::uint32_t id = Uses(*other, DataId(node)) ? DataId(node) : RequestId(node);
      if (!Uses(*other, id)) continue;
      devices.Error(other->name, Text("identifier 0x%03X is that of %s (node 0x%02X) too: each encoder needs "
                                      "identifiers of its own",
                                      unsigned{id}, first->name.c_str(), unsigned{node}));
    }
  }
}

// Checks that the frames that encoders send by themselves fit on the wire.
void CheckLoad(ConfigMap& map, const BusConfig& bus) {
  double share = 0;
  for (const DeviceConfig& device : bus.devices) {
    const DeviceSettings& settings = *device.settings;
    if (settings.own_period == 0) continue;
    share += static_cast<double>(settings.wire_time) / static_cast<double>(settings.own_period);
  }
  if (share <= 1) return;
  map.Error("devices",
            Text("what they send by themselves needs %.0f %% of the wire at %lld bit/s: choose longer periods",
                 share * 100, static_cast<long long>(bus.link.bitrate)));
}

}  // namespace

std::shared_ptr<const FamilyBus> ParseBus(ConfigMap& map, const BusConfig&) {
  auto own = std::make_shared<SaaCanBus>();
  own->bench = map.Bool("bench", false);
  return own;
}

std::unique_ptr<DeviceSettings> ParseDevice(ConfigMap& device, const BusConfig& bus) {
  const bool standard = device.Has("model") && device.Choice("model", Models(), 0) + 1 == Models().size();
  return standard ? cia406::ParseDevice(device, bus) : ParseOwn(device, bus);
}

void CheckBus(ConfigMap& map, const BusConfig& bus) {
  cia406::CheckBus(map, bus);
  CheckIds(map, bus);
  CheckLoad(map, bus);
  if (OwnBus(bus).bench && (bus.devices.size() != 1 || cia406::IsOwn(bus.devices.front()))) {
    map.Error("bench", "is for one SAA encoder that is alone on its bus: its operations go to every node");
  }
}

const SaaCanBus& OwnBus(const BusConfig& bus) { return static_cast<const SaaCanBus&>(*bus.family_bus); }
const SaaCanSettings& Own(const DeviceConfig& device) {
  return static_cast<const SaaCanSettings&>(*device.settings);
}

std::optional<std::uint8_t> PerSecond(std::int64_t period_ms) {
  if (period_ms <= 0 || 1'000 % period_ms != 0 || 1'000 / period_ms > 0xFF) return std::nullopt;
  return static_cast<std::uint8_t>(1'000 / period_ms);
}

std::int64_t ZeroToleranceCounts(int bits) {
  const double counts = kZeroToleranceDeg / 360 * static_cast<double>(std::int64_t{1} << bits);
  return std::max<std::int64_t>(2, std::llround(counts));
}

}  // namespace axlecast::saa_can
