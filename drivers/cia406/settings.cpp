#include "drivers/cia406/settings.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "core/device/can.h"
#include "core/device/operation.h"
#include "drivers/cia406/cia406.h"
#include "drivers/cia406/simulator.h"

namespace axlecast::cia406 {
namespace {

constexpr int kMinBits = 8;
constexpr int kMaxBits = 28;
constexpr int kMaxTurnsBits = 16;
constexpr int kPositionBits = 32;  // 6004h
// Identifiers that a TPDO may have (CiA 301 table 41 excludes the others).
constexpr std::int64_t kMinCobId = 0x181;
constexpr std::int64_t kMaxCobId = 0x57F;
// The profile gives no limits: the fastest of ordinary encoders, and a repeatability of 0.05 degrees.
constexpr double kMaxSpeedRpm = 12'000;
constexpr double kNoiseDeg = 0.05;
constexpr double kPresetToleranceDeg = 0.2;

std::int64_t CountsOf(double degrees, int bits) {
  return static_cast<std::int64_t>(std::ceil(degrees / 360 * static_cast<double>(std::int64_t{1} << bits)));
}

void ParseResolution(ConfigMap& device, Cia406Settings& settings) {
  device.Require("bits", "single-turn resolution, 2^bits = object 6001h");
  settings.bits = static_cast<int>(device.Integer("bits", 13, kMinBits, kMaxBits, "bits"));
  settings.turn_bits = static_cast<int>(device.Integer("turn_bits", 0, 0, kMaxTurnsBits, "bits"));
  if (settings.total_bits() > kPositionBits) {
    device.Error("turn_bits", "with bits " + std::to_string(settings.bits) + " at most " +
                                  std::to_string(kPositionBits - settings.bits) +
                                  ": the position value 6004h has 32 bits");
    settings.turn_bits = kPositionBits - settings.bits;
  }
  settings.counts_per_turn = std::int64_t{1} << settings.bits;
  settings.turns_range = settings.turn_bits > 0 ? std::int64_t{1} << settings.turn_bits : 0;
  settings.ccw_increases = device.Choice("counting", {"cw", "ccw"}, 0) == 1;
  settings.max_speed_rpm = kMaxSpeedRpm;
  settings.noise_counts = std::max<std::int64_t>(1, CountsOf(kNoiseDeg, settings.bits));
}

void ParseMode(ConfigMap& device, const BusConfig& bus, Cia406Settings& settings) {
  const bool polled = device.Choice("mode", {"tpdo", "sdo"}, 0) == 1;
  const bool sync = device.Choice("transmission", {"as_configured", "sync"}, 0) == 1;
  settings.mode = polled ? Mode::kPolled : sync ? Mode::kSync : Mode::kCyclic;
  if (polled && device.Has("transmission")) {
    device.Error("transmission", "is of mode tpdo only: in mode sdo the position is read at poll_hz");
  }
  if (settings.mode == Mode::kSync && bus.poll_hz <= 0) {
    device.Error("transmission", "sync needs poll_hz at the bus: the rate at which SYNC is sent");
  }
  for (const char* key : {"period_ms", "processing_us"}) {
    if (settings.mode != Mode::kCyclic && device.Has(key)) {
      device.Error(key, "is of mode tpdo with transmission as_configured only: leave it out");
    }
  }
  if (polled && device.Has("cob_id")) device.Error("cob_id", "is of mode tpdo only: leave it out");
  settings.cob_id = static_cast<std::uint32_t>(
      device.Integer("cob_id", kTpdo1Id + settings.node, kMinCobId, kMaxCobId, "(0x181 to 0x57F)"));
  settings.period = device.Integer("period_ms", 100, 1, 65'535, "ms, of the encoder's TPDO1") * kMillisecond;
  settings.processing =
      device.Integer("processing_us", 1'000, 0, 1'000'000, "us, from sampling to the frame's first bit") *
      kMicrosecond;
}

void ParseTimes(ConfigMap& device, Cia406Settings& settings) {
  const auto milliseconds = [&](const char* key, std::int64_t usual, std::int64_t minimum, std::int64_t maximum) {
    return device.Integer(key, usual, minimum, maximum, "ms") * kMillisecond;
  };
  settings.heartbeat = milliseconds("heartbeat_ms", 0, 0, 600'000);
  settings.sdo_timeout = milliseconds("sdo_timeout_ms", 200, 2, 60'000);
  settings.diagnostics = milliseconds("diagnostics_ms", 1'000, 0, 3'600'000);
  settings.preset_settle = milliseconds("preset_settle_ms", 50, 1, 10'000);
}

void ParseIdentity(ConfigMap& device, Cia406Settings& settings) {
  ConfigMap identity = device.Map("identity");
  for (std::size_t part = 0; part < kIdentityParts; ++part) {
    const char* name = kIdentityNames.at(part);
    if (!identity.Has(name)) continue;
    settings.identity.at(part) = static_cast<std::uint32_t>(identity.Integer(name, 0, 0, UINT32_MAX, "(1018h)"));
  }
  identity.Done();
}

MonoNs WireTime(const Cia406Settings& settings, const CanFrameTime& time) {
  switch (settings.mode) {
    case Mode::kCyclic:
      return time.Longest(kPositionSize);
    case Mode::kSync:
      return time.Longest(0) + time.Longest(kPositionSize);
    case Mode::kPolled:
      break;
  }
  return 2 * time.Longest(kSdoSize);
}

// SYNC has no data. From the end of the frame to the sampling, no document states a time.
MonoNs LatchAfter(const Cia406Settings& settings, const CanFrameTime& time) {
  return time.Longest(settings.mode == Mode::kSync ? 0 : kSdoSize);
}

CanFilters Filters(const Cia406Settings& settings) {
  CanFilters filters = {OnlyStandard(kSyncId), OnlyStandard(kEmergencyId + settings.node),
                        OnlyStandard(kSdoAnswerId + settings.node), OnlyStandard(kHeartbeatId + settings.node)};
  if (settings.mode != Mode::kPolled) filters.push_back(OnlyStandard(settings.cob_id));
  return filters;
}

// The identity of a simulated encoder if the file has none: no maker's vendor id, because CiA assigns ids from 1 on.
constexpr std::array<std::uint32_t, kIdentityParts> kSimulatedIdentity = {0, 0x00000406, 0x00010000, 1001};

std::uint16_t HalfInMilliseconds(MonoNs time) {
  return static_cast<std::uint16_t>(std::clamp<MonoNs>(time / 2 / kMillisecond, time > 0 ? 1 : 0, 0xFFFF));
}

}  // namespace

const Cia406Settings& Own(const DeviceConfig& device) {
  return static_cast<const Cia406Settings&>(*device.settings);
}

bool ProducesSync(const BusConfig& bus, const DeviceConfig& device) {
  const auto first = std::find_if(bus.devices.begin(), bus.devices.end(), [](const DeviceConfig& other) {
    return IsOwn(other) && Own(other).mode == Mode::kSync;
  });
  return first != bus.devices.end() && first->settings == device.settings;
}

std::int64_t PresetToleranceCounts(int bits) {
  return std::max<std::int64_t>(2, CountsOf(kPresetToleranceDeg, bits));
}

std::unique_ptr<DeviceSettings> ParseDevice(ConfigMap& device, const BusConfig& bus) {
  auto settings = std::make_unique<Cia406Settings>();
  settings->model = kModel;
  device.Require("node", "the encoder's node id, 1 to 127");
  settings->node = static_cast<std::uint8_t>(device.Integer("node", kMinNode, kMinNode, kMaxNode, ""));
  ParseResolution(device, *settings);
  ParseMode(device, bus, *settings);
  ParseTimes(device, *settings);
  if (settings->mode != Mode::kCyclic) settings->reply_timeout = settings->sdo_timeout;
  settings->nmt_start = device.Bool("nmt_start", true);
  ParseIdentity(device, *settings);
  settings->wire_time = WireTime(*settings, {bus.link.bitrate});
  settings->latch_after = LatchAfter(*settings, {bus.link.bitrate});
  settings->own_period = settings->mode == Mode::kCyclic ? settings->period : 0;
  settings->can_filters = Filters(*settings);
  return settings;
}

void CheckBus(ConfigMap& map, const BusConfig& bus) {
  std::map<std::uint32_t, std::string> taken;
  ConfigMap devices = map.Map("devices");
  for (const DeviceConfig& device : bus.devices) {
    if (!IsOwn(device)) continue;
    const Cia406Settings& own = Own(device);
    const auto take = [&](std::uint32_t id, const std::string& what) {
      const auto [first, added] = taken.emplace(id, device.name);
      if (added) return true;
      devices.Error(device.name, what + " is that of " + first->second + " too: each node needs its own");
      return false;
    };
    const bool alone = take(kSdoRequestId + own.node, "node " + std::to_string(own.node));
    if (alone && own.mode != Mode::kPolled) take(own.cob_id, Text("cob_id 0x%03X", own.cob_id));
  }
}

bool UsesId(const DeviceConfig& device, std::uint32_t id) {
  const Cia406Settings& own = Own(device);
  return id == kNmtId || id == kSyncId || id == kEmergencyId + own.node || id == kSdoAnswerId + own.node ||
         id == kSdoRequestId + own.node || id == kHeartbeatId + own.node ||
         (own.mode != Mode::kPolled && id == own.cob_id);
}

std::unique_ptr<SimulatedCanNode> MakeNode(const DeviceConfig& device, ConfigMap simulate) {
  const Cia406Settings& settings = Own(device);
  Cia406Node::Setup setup;
  setup.node = settings.node;
  setup.bits = settings.bits;
  setup.turn_bits = settings.turn_bits;
  setup.ccw = settings.ccw_increases;
  setup.cob_id = settings.cob_id;
  setup.transmission = settings.mode == Mode::kSync ? 1 : 254;
  setup.timer_ms = static_cast<std::uint16_t>(settings.period / kMillisecond);
  setup.heartbeat_ms = static_cast<std::uint16_t>(
      simulate.Integer("heartbeat_ms", HalfInMilliseconds(settings.heartbeat), 0, 0xFFFF, "ms"));
  for (std::size_t part = 0; part < kIdentityParts; ++part) {
    const std::uint32_t usual = settings.identity.at(part).value_or(kSimulatedIdentity.at(part));
    setup.identity.at(part) =
        static_cast<std::uint32_t>(simulate.Integer(kIdentityNames.at(part), usual, 0, UINT32_MAX, "(1018h)"));
  }
  setup.seed = static_cast<std::uint64_t>(simulate.Integer("seed", 1, 0, INT64_MAX, ""));
  setup.angle = AngleFromDegrees(simulate.Number("start_deg", 0, 0, 360, "deg"));
  auto node = std::make_unique<Cia406Node>(setup);
  node->SetScript(ReadScriptOf(simulate, *node));
  return node;
}

}  // namespace axlecast::cia406
