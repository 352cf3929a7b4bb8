#include "drivers/runtime/axis/device_report.h"

#include <algorithm>

#include "core/base/text.h"
#include "core/command/operation_check.h"

namespace axlecast {
namespace {

constexpr std::size_t kSerialBytes = 32;
constexpr std::size_t kWhyBytes = 120;
constexpr std::size_t kMaxOperations = 24;

MonoNs Period(double hz) { return hz > 0 ? static_cast<MonoNs>(static_cast<double>(kSecond) / hz) : 0; }

std::int32_t Microseconds(MonoNs ns) {
  return static_cast<std::int32_t>(std::min<MonoNs>(ns / kMicrosecond, INT32_MAX));
}

// Those that `permits` returns true for.
template <typename Permits>
void AddOperations(std::span<const OperationSpec> operations, Permits permits, device_info_t& info) {
  for (const OperationSpec& operation : operations) {
    if (operation.internal || !permits(operation.name) || info.operations.size() == kMaxOperations) continue;
    info.operations.push_back(CappedText(operation.name, kNameBytes));
  }
}

}  // namespace

MonoNs PollPeriod(const BusConfig& bus, const DeviceConfig& device) {
  if (device.settings->own_period > 0) return device.settings->own_period;
  return bus.poll_hz > 0 ? Period(bus.poll_hz) : RoundTime(bus);
}

MonoNs DeviceReport::MaxAge(MonoNs poll, MonoNs publish) {
  return std::max(20 * kMillisecond, 3 * std::max(poll, publish));
}

DeviceReport::DeviceReport(const BusConfig& bus, const DeviceConfig& device, std::int64_t boot_id) : info_{} {
  const MonoNs publish = Period(device.publish_hz);
  info_.boot_id = boot_id;
  info_.seq = -1;
  info_.device = CappedText(device.name, kNameBytes);
  info_.bus = CappedText(bus.name, kNameBytes);
  info_.family = CappedText(bus.family != nullptr ? bus.family->name : "", kNameBytes);
  info_.model = CappedText(device.model, kNameBytes);
  info_.identity = -1;
  info_.config_hash = device.config_hash;
  info_.counts_per_turn = device.settings->counts_per_turn;
  info_.turns_range = device.settings->turns_range;
  info_.ratio_num = device.ratio_num;
  info_.ratio_den = device.ratio_den;
  info_.per_turn = device.per_turn;
  info_.direction = static_cast<std::int8_t>(device.direction);
  info_.unit = device.unit;
  info_.modulo = device.modulo;
  info_.poll_us = Microseconds(Period(bus.poll_hz));
  info_.publish_us = Microseconds(publish);
  info_.max_age_us = Microseconds(MaxAge(PollPeriod(bus, device), publish));
  if (bus.family != nullptr) {
    const auto permits = [&](std::string_view operation) {
      return bus.family->permits == nullptr || bus.family->permits(bus, device, operation);
    };
    AddOperations(bus.family->operations, permits, info_);
    AddOperations(
        RuntimeOperations(*bus.family), [](std::string_view) { return true; }, info_);
  }
  info_.n_operations = static_cast<std::int8_t>(info_.operations.size());
}

void DeviceReport::SetIdentity(std::int64_t identity, std::string_view serial, std::string_view firmware) {
  if (identity == info_.identity && serial == info_.serial && firmware == info_.firmware) return;
  info_.identity = identity;
  info_.serial = CappedText(serial, kSerialBytes);
  info_.firmware = CappedText(firmware, kSerialBytes);
  identity_ = identity < 0 ? "" : std::to_string(identity);
  if (!info_.serial.empty()) identity_ += (identity_.empty() ? "" : " ") + info_.serial;
  ++revision_;
}

void DeviceReport::SetProductCode(std::string_view code) {
  if (code == info_.product_code) return;
  info_.product_code = CappedText(code, kSerialBytes);
  ++revision_;
}

void DeviceReport::CountNonVolatileWrite() {
  ++info_.nv_writes;
  ++revision_;
}

const device_info_t& DeviceReport::Write(const DeviceHealth& health, const Reference& reference,
                                         const Timebase& time, MonoNs now) {
  ++info_.seq;
  info_.mono_ns = now;
  info_.utime = time.Utime(now);
  info_.state = health.state();
  if (health_revision_ != health.revision()) info_.reason = CappedText(health.reason(), kWhyBytes);
  health_revision_ = health.revision();
  info_.datum_counts = reference.datum();
  info_.datum_utime = reference.utime();
  info_.datum_epoch = reference.epoch();
  info_.reference_lost = reference.lost() ? 1 : 0;
  info_.good = health.good();
  for (std::size_t i = 0; i < kErrorKinds; ++i) info_.errors[i] = health.errors(static_cast<ErrorKind>(i));
  info_.last_good_utime = health.last_good() == kNever ? 0 : time.Utime(health.last_good());
  return info_;
}

}  // namespace axlecast
