#include "drivers/saa_can/family.h"

#include "core/config/config_map.h"
#include "drivers/cia406/cia406.h"
#include "drivers/saa_can/settings.h"
#include "drivers/saa_can/simulator.h"

namespace axlecast {
namespace saa_can {
namespace {

std::unique_ptr<SimulatedCanNode> MakeNode(const BusConfig& bus, const DeviceConfig& device, ConfigMap map) {
  const SaaCanSettings& settings = Own(device);
  // An encoder whose period will be set begins with the factory's.
  const bool factory = settings.set_per_second || settings.mode == Mode::kSingle;
  auto node = std::make_unique<SaaNode>(
      SaaNode::Setup{.node = settings.node,
                     .bits = settings.format.bits,
                     .big_endian = settings.format.big_endian,
                     .bitrate = bus.link.bitrate,
                     .period_ms = static_cast<double>(factory ? kFactoryPeriodMs : settings.period / kMillisecond),
                     .cyclic = settings.mode == Mode::kCyclic,
                     .positive = settings.positive_byte.value_or(-1),
                     .negative = settings.negative_byte.value_or(-1),
                     .stop = settings.stop_byte.value_or(-1),
                     .angle = AngleFromDegrees(map.Number("start_deg", 0, 0, 360, "deg")),
                     .seed = static_cast<std::uint64_t>(map.Integer("seed", 1, 0, INT64_MAX, ""))});
  node->SetScript(ReadScriptOf(map, *node));
  return node;
}

std::unique_ptr<Simulator> MakeSimulator(const BusConfig& bus, ConfigMap& simulate) {
  if (bus.devices.empty()) return nullptr;  // already an error of the file
  const std::size_t errors = simulate.errors().list().size();
  std::vector<CanBus::Unit> units;
  for (const DeviceConfig& device : bus.devices) {
    ConfigMap map = simulate.Named(device.name);
    units.push_back(
        {device.name, cia406::IsOwn(device) ? cia406::MakeNode(device, map) : MakeNode(bus, device, map)});
  }
  if (simulate.errors().list().size() != errors) return nullptr;
  return std::make_unique<CanBus>(bus.link.bitrate, std::move(units));
}

}  // namespace
}  // namespace saa_can

const Family& saa_can_family() {
  static const Family kFamily = {
      .name = "saa_can",
      .summary = "Rongde SAA encoders on CAN, cyclic or polled; and CANopen encoders (model: cia406)",
      .link = LinkKind::kCan,
      .default_bitrate = saa_can::kFactoryBitrate,
      .default_poll_hz = 0,  // at the encoders' own period
      .max_devices_per_bus = saa_can::kMaxDevices,
      .operations = saa_can::Operations(),
      .permits = &saa_can::Permits,
      .alarms =
          [](const DeviceConfig& device) {
            return cia406::IsOwn(device) ? cia406::Alarms() : std::vector<AlarmSpec>();
          },
      .parse_bus = &saa_can::ParseBus,
      .parse = &saa_can::ParseDevice,
      .check_bus = &saa_can::CheckBus,
      .make_device = &saa_can::MakeDevice,
      .make_simulator = &saa_can::MakeSimulator,
      .decode = &saa_can::Decode,
  };
  return kFamily;
}

}  // namespace axlecast
