#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/config/machine_config.h"
#include "tools/mqtt/sparkplug/metric_table.h"

namespace axlecast {

// A channel that has metrics.
struct MetricChannel {
  std::string_view name;  // of the device or the bus
  bool is_bus = false;
};
[[nodiscard]] std::optional<MetricChannel> FindMetricChannel(std::string_view channel);

// The metrics of one LCM message: the table in docs/sparkplug.md.
struct MessageMetrics {
  std::string device = {};        // empty: the node
  std::int64_t timestamp_ms = 0;  // ms, UNIX time
  std::vector<MetricReading> readings = {};
  bool is_all_alarms = false;                              // ALARM: every alarm that it does not list is absent
  std::optional<std::int8_t> device_state = std::nullopt;  // device_info_t STATE_*
};

// `channel`: without the LCM prefix; of an
// outcome "COMMAND_STATUS/<device>". Returns nothing if the channel has no metrics or
// the message is of another type.
[[nodiscard]] std::optional<MessageMetrics> MetricsOf(std::string_view channel, Bytes message);

// Returns the metrics of a device or of the node, without values.
[[nodiscard]] std::vector<MetricReading> DeviceMetrics(const BusConfig& bus, const DeviceConfig& device);
[[nodiscard]] std::vector<MetricReading> NodeMetrics(const MachineConfig& machine);

// Returns "Alarm/<name>/Active" readings that are false for all alarms in `known` that `listed` does not contain.
[[nodiscard]] std::vector<MetricReading> AbsentAlarms(const std::vector<MetricReading>& known,
                                                      const std::vector<MetricReading>& listed);

}  // namespace axlecast
