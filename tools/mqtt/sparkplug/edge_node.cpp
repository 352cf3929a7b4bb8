#include "tools/mqtt/sparkplug/edge_node.h"

#include <algorithm>
#include <axlecast/device_info_t.hpp>
#include <utility>

namespace axlecast {
namespace {

SparkplugMetric Plain(std::string name, SparkplugType type, SparkplugValue value, std::int64_t now_ms) {
  return {.name = std::move(name),
          .alias = std::nullopt,
          .timestamp_ms = now_ms,
          .type = type,
          .value = std::move(value)};
}

// Adds the alarms that a list of all alarms does not have.
void Complete(MessageMetrics& message, const MetricTable& table) {
  if (!message.is_all_alarms) return;
  std::vector<MetricReading> absent = AbsentAlarms(table.metrics(), message.readings);
  std::move(absent.begin(), absent.end(), std::back_inserter(message.readings));
}

std::int64_t Milliseconds(const Timestamp& now) { return now.utime / 1'000; }

}  // namespace

EdgeNode::EdgeNode(const MachineConfig& machine, SparkplugTopics topics, std::string_view version, MonoNs start)
    : topics_(std::move(topics)), node_(next_alias_) {
  node_.Define({"Version", SparkplugType::kString, std::string(version)});
  for (MetricReading& metric : NodeMetrics(machine)) node_.Define(std::move(metric));
  for (const BusConfig& bus : machine.buses) {
    buses_.insert(bus.name);
    for (const DeviceConfig& config : bus.devices) {
      Device& device = devices_.emplace(config.name, Device{MetricTable(next_alias_), start}).first->second;
      for (MetricReading& metric : DeviceMetrics(bus, config)) device.table.Define(std::move(metric));
    }
  }
}

void EdgeNode::BeginSession(std::uint8_t birth_sequence) {
  birth_sequence_ = birth_sequence;
  for (auto& [name, device] : devices_) device.born = false;
}

BrokerMessage EdgeNode::Death(std::int64_t now_ms) const {
  SparkplugPayload payload{.timestamp_ms = now_ms, .seq = std::nullopt};
  payload.metrics.push_back(Plain("bdSeq", SparkplugType::kInt64, std::int64_t{birth_sequence_}, now_ms));
  return {.topic = topics_.OfNode("NDEATH"), .payload = EncodePayload(payload), .retain = false, .qos = 1};
}

BrokerMessage EdgeNode::Message(const std::string& topic, std::vector<SparkplugMetric> metrics,
                                std::int64_t now_ms) {
  const SparkplugPayload payload{.timestamp_ms = now_ms, .seq = seq_++, .metrics = std::move(metrics)};
  return {.topic = topic, .payload = EncodePayload(payload), .retain = false, .qos = 0};
}

std::vector<BrokerMessage> EdgeNode::Births(bool all, Timestamp now) {
  const std::int64_t now_ms = Milliseconds(now);
  seq_ = 0;
  std::vector<SparkplugMetric> metrics = node_.Birth(now_ms);
  metrics.push_back(Plain("bdSeq", SparkplugType::kInt64, std::int64_t{birth_sequence_}, now_ms));
  metrics.push_back(Plain(std::string(kRebirthMetric), SparkplugType::kBoolean, false, now_ms));
  std::vector<BrokerMessage> messages = {Message(topics_.OfNode("NBIRTH"), std::move(metrics), now_ms)};
  for (auto& [name, device] : devices_) {
    device.born = all || IsAlive(device, now.mono);
    if (!IsAlive(device, now.mono)) static_cast<void>(device.table.MarkStale(now_ms));
    if (device.born) messages.push_back(BirthOf(name, device, now_ms));
  }
  return messages;
}

BrokerMessage EdgeNode::BirthOf(const std::string& name, Device& device, std::int64_t now_ms) {
  device.born = true;
  return Message(topics_.OfDevice("DBIRTH", name), device.table.Birth(now_ms), now_ms);
}

bool EdgeNode::IsAlive(const Device& device, MonoNs now) {
  return device.online && now - device.heard_at < kSilent;
}

MetricTable* EdgeNode::TableOf(const std::string& device) {
  if (device.empty()) return &node_;
  const auto found = devices_.find(device);
  return found == devices_.end() ? nullptr : &found->second.table;
}

std::string EdgeNode::DataTopic(const std::string& device) const {
  return device.empty() ? topics_.OfNode("NDATA") : topics_.OfDevice("DDATA", device);
}

bool EdgeNode::Publishes(std::string_view channel) const {
  const std::optional<MetricChannel> found = FindMetricChannel(channel);
  if (!found) return false;
  return found->is_bus ? buses_.contains(found->name) : devices_.contains(found->name);
}

void EdgeNode::OnHeard(std::string_view channel, MonoNs now) {
  const auto device = devices_.find(channel.substr(std::min(channel.find('/') + 1, channel.size())));
  if (device != devices_.end()) device->second.heard_at = now;
}

std::vector<BrokerMessage> EdgeNode::OnSample(std::string_view channel, Bytes message, bool live, Timestamp now) {
  std::optional<MessageMetrics> sample = MetricsOf(channel, message);
  MetricTable* const table = sample ? TableOf(sample->device) : nullptr;
  if (table == nullptr) return {};
  Complete(*sample, *table);
  MetricTable::Changes changes = table->Apply(sample->readings, sample->timestamp_ms);
  const std::int64_t now_ms = Milliseconds(now);
  std::vector<BrokerMessage> messages;
  if (!sample->device.empty()) {
    Device& device = devices_.find(sample->device)->second;
    if (sample->device_state) {
      device.online = *sample->device_state == device_info_t::STATE_ONLINE ||
                      *sample->device_state == device_info_t::STATE_DEGRADED;
    }
    if (!live || (!device.born && !IsAlive(device, now.mono))) return {};
    if (!device.born || changes.needs_birth) return {BirthOf(sample->device, device, now_ms)};
  } else if (changes.needs_birth) {
    changes.metrics.clear();  // of a bus that is not in the machine's file
  }
  if (live && !changes.metrics.empty()) {
    messages.push_back(Message(DataTopic(sample->device), std::move(changes.metrics), now_ms));
  }
  return messages;
}

std::vector<BrokerMessage> EdgeNode::Deaths(Timestamp now) {
  const std::int64_t now_ms = Milliseconds(now);
  std::vector<BrokerMessage> messages;
  for (auto& [name, device] : devices_) {
    if (!device.born || IsAlive(device, now.mono)) continue;
    std::vector<SparkplugMetric> stale = device.table.MarkStale(now_ms);
    if (!stale.empty()) messages.push_back(Message(DataTopic(name), std::move(stale), now_ms));
    messages.push_back(Message(topics_.OfDevice("DDEATH", name), {}, now_ms));
    device.born = false;
  }
  return messages;
}

std::vector<BrokerMessage> EdgeNode::Historical(const std::vector<StoredSample>& samples, Timestamp now) {
  const std::int64_t now_ms = Milliseconds(now);
  std::vector<BrokerMessage> messages;
  std::vector<SparkplugMetric> metrics;
  std::string of;  // the device of `metrics`
  const auto flush = [&] {
    if (!metrics.empty()) messages.push_back(Message(DataTopic(of), std::exchange(metrics, {}), now_ms));
  };
  for (const StoredSample& stored : samples) {
    std::optional<MessageMetrics> sample = MetricsOf(stored.channel, stored.message);
    MetricTable* const table = sample ? TableOf(sample->device) : nullptr;
    const auto device = sample ? devices_.find(sample->device) : devices_.end();
    if (table == nullptr) {
      ++unknown_;
      continue;
    }
    if (device != devices_.end() && !device->second.born) continue;
    Complete(*sample, *table);
    MetricTable::Changes changes = table->Historical(sample->readings, sample->timestamp_ms);
    if (sample->device != of || changes.needs_birth || metrics.size() + changes.metrics.size() > kMaxMetrics)
      flush();
    of = sample->device;
    if (changes.needs_birth && device != devices_.end()) messages.push_back(BirthOf(of, device->second, now_ms));
    std::move(changes.metrics.begin(), changes.metrics.end(), std::back_inserter(metrics));
  }
  flush();
  return messages;
}

}  // namespace axlecast
