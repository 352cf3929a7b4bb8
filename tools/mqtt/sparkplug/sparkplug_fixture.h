#pragma once

#include <gtest/gtest.h>

#include <axlecast/alarm_t.hpp>
#include <axlecast/device_info_t.hpp>
#include <axlecast/position_t.hpp>
#include <cstring>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/config/machine_config.h"
#include "core/messages/broker_link.h"
#include "core/messages/message.h"

namespace axlecast {

// A second reader of payloads, for tests only: field numbers of the specification's schema, all fields as numbers and texts.
class ReadFields {
 public:
  explicit ReadFields(std::string_view bytes) {
    while (!bytes.empty()) {
      const std::uint64_t key = Varint(bytes);
      const auto field = static_cast<int>(key >> 3U);
      switch (key & 7U) {
        case 0:
          numbers_.emplace(field, Varint(bytes));
          break;
        case 1:
          numbers_.emplace(field, Fixed(bytes, 8));
          break;
        case 5:
          numbers_.emplace(field, Fixed(bytes, 4));
          break;
        default: {
          const std::uint64_t size = Varint(bytes);
          texts_.emplace(field, std::string(bytes.substr(0, size)));
          bytes.remove_prefix(size);
        }
      }
    }
  }

  [[nodiscard]] std::optional<std::uint64_t> Number(int field) const {
    const auto found = numbers_.find(field);
    return found == numbers_.end() ? std::nullopt : std::optional(found->second);
  }
  [[nodiscard]] std::vector<std::string> Texts(int field) const {
    std::vector<std::string> texts;
    for (auto [at, end] = texts_.equal_range(field); at != end; ++at) texts.push_back(at->second);
    return texts;
  }
  [[nodiscard]] std::string Text(int field) const {
    const auto found = texts_.find(field);
    return found == texts_.end() ? "" : found->second;
  }

 private:
  static std::uint64_t Varint(std::string_view& bytes) {
    std::uint64_t number = 0;
    for (unsigned shift = 0; !bytes.empty(); shift += 7) {
      const auto byte = static_cast<std::uint8_t>(bytes.front());
      bytes.remove_prefix(1);
      number |= std::uint64_t{byte & 0x7FU} << shift;
      if (byte < 0x80) break;
    }
    return number;
  }
  static std::uint64_t Fixed(std::string_view& bytes, std::size_t size) {
    std::uint64_t number = 0;
    std::memcpy(&number, bytes.data(), size);
    bytes.remove_prefix(size);
    return number;
  }

  std::multimap<int, std::uint64_t> numbers_;
  std::multimap<int, std::string> texts_;
};

struct ReadMetric {
  std::string name;
  std::optional<std::uint64_t> alias;
  std::uint64_t timestamp_ms = 0;
  std::uint64_t datatype = 0;
  bool is_historical = false;
  bool is_transient = false;
  bool is_null = false;
  std::optional<std::uint64_t> number;  // int, long, boolean
  std::optional<double> real;           // double
  std::string text;
  std::map<std::string, ReadFields> properties;

  [[nodiscard]] std::optional<std::uint64_t> Quality() const {
    const auto found = properties.find("Quality");
    return found == properties.end() ? std::nullopt : found->second.Number(3);
  }
};

struct ReadPayload {
  std::string topic;
  int qos = 0;
  bool retain = false;
  std::uint64_t timestamp_ms = 0;
  std::optional<std::uint64_t> seq;
  std::vector<ReadMetric> metrics;

  // Returns the type and the device of the topic: "DDATA/axis1".
  [[nodiscard]] std::string Kind() const {
    const std::size_t type = topic.find('/', topic.find('/') + 1) + 1;
    const std::size_t node = topic.find('/', type);
    const std::size_t device = topic.find('/', node + 1);
    return topic.substr(type, node - type) + (device == std::string::npos ? "" : topic.substr(device));
  }
  [[nodiscard]] const ReadMetric* Find(std::string_view name) const {
    for (const ReadMetric& metric : metrics) {
      if (metric.name == name) return &metric;
    }
    return nullptr;
  }
  [[nodiscard]] const ReadMetric* Find(std::optional<std::uint64_t> alias) const {
    for (const ReadMetric& metric : metrics) {
      if (alias && metric.alias == alias) return &metric;
    }
    return nullptr;
  }
};

inline ReadPayload Read(const BrokerMessage& message) {
  const ReadFields fields(message.payload);
  ReadPayload payload{.topic = message.topic,
                      .qos = message.qos,
                      .retain = message.retain,
                      .timestamp_ms = fields.Number(1).value_or(0),
                      .seq = fields.Number(3),
                      .metrics = {}};
  for (const std::string& bytes : fields.Texts(2)) {
    const ReadFields read(bytes);
    ReadMetric metric;
    metric.name = read.Text(1);
    metric.alias = read.Number(2);
    metric.timestamp_ms = read.Number(3).value_or(0);
    metric.datatype = read.Number(4).value_or(0);
    metric.is_historical = read.Number(5) == 1U;
    metric.is_transient = read.Number(6) == 1U;
    metric.is_null = read.Number(7) == 1U;
    for (const int field : {10, 11, 14}) {
      if (read.Number(field)) metric.number = read.Number(field);
    }
    if (const auto bits = read.Number(13)) {
      metric.real = 0;
      std::memcpy(&*metric.real, &*bits, sizeof *bits);
    }
    metric.text = read.Text(15);
    const ReadFields set(read.Text(9));
    const std::vector<std::string> keys = set.Texts(1);
    const std::vector<std::string> values = set.Texts(2);
    EXPECT_EQ(keys.size(), values.size());
    for (std::size_t i = 0; i < keys.size() && i < values.size(); ++i)
      metric.properties.emplace(keys[i], values[i]);
    payload.metrics.push_back(std::move(metric));
  }
  return payload;
}

// A machine with a bus and two axes.
inline MachineConfig SparkplugMachine() {
  MachineConfig machine;
  machine.machine = "press3";
  BusConfig bus;
  bus.name = "rs485-0";
  for (const char* name : {"axis1", "axis2"}) {
    DeviceConfig device;
    device.name = name;
    device.unit = position_t::UNIT_MM;
    bus.devices.push_back(device);
  }
  machine.buses.push_back(bus);
  return machine;
}

inline constexpr std::int32_t kGoodFlags =
    std::int32_t{position_t::FLAG_VALID} | std::int32_t{position_t::FLAG_TURNS_VALID};

inline constexpr std::int64_t kStartUtime = 1'790'000'000'000'000;  // us, in 2026

inline std::vector<std::uint8_t> PositionMessage(std::int64_t seq, double value, std::int64_t utime,
                                                 std::int32_t flags = kGoodFlags) {
  position_t position{};
  position.utime = utime;
  position.boot_id = 0x1234;
  position.seq = seq;
  position.value = value;
  position.counts = seq * 10;
  position.unit = position_t::UNIT_MM;
  position.flags = flags;
  return Encoded(position);
}

inline std::vector<std::uint8_t> DeviceMessage(std::int8_t state, std::int64_t utime,
                                               const std::string& name = "axis1") {
  device_info_t info{};
  info.utime = utime;
  info.device = name;
  info.state = state;
  info.model = "TS5667";
  return Encoded(info);
}

inline std::vector<std::uint8_t> AlarmMessage(const std::vector<std::string>& names, std::int64_t utime,
                                              std::int8_t state = alarm_entry_t::STATE_LIVE) {
  alarm_t alarm{};
  alarm.utime = utime;
  for (const std::string& name : names) {
    alarm_entry_t entry{};
    entry.name = name;
    entry.severity = alarm_entry_t::SEVERITY_ERROR;
    entry.state = state;
    entry.action = "act";
    alarm.entries.push_back(entry);
  }
  alarm.n = static_cast<std::int8_t>(names.size());
  alarm.total = alarm.n;
  return Encoded(alarm);
}

}  // namespace axlecast
