#include "drivers/cia406/cia406.h"

#include <algorithm>
#include <memory>

#include "core/config/config_map.h"
#include "drivers/cia406/device.h"
#include "drivers/cia406/settings.h"
#include "drivers/cia406/simulator.h"

namespace axlecast::cia406 {
namespace {

// Of an encoder that the file does not describe: no maker's vendor id (CiA gives out ids from 1 on).
constexpr std::array<std::uint32_t, kIdentityParts> kIdentity = {0, 0x00000406, 0x00010000, 1001};

std::uint16_t HalfInMilliseconds(MonoNs time) {
  return static_cast<std::uint16_t>(std::clamp<MonoNs>(time / 2 / kMillisecond, time > 0 ? 1 : 0, 0xFFFF));
}

}  // namespace

std::unique_ptr<Device> MakeDevice(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output) {
  return std::make_unique<Cia406Device>(bus, device, output);
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
    const std::uint32_t usual = settings.identity.at(part).value_or(kIdentity.at(part));
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
