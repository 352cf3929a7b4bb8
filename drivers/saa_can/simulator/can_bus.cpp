#include "drivers/saa_can/simulator/can_bus.h"

#include <algorithm>

namespace axlecast::saa_can {
namespace {

// Nodes that answer each other at once without end are a mistake of theirs; the host must go on.
constexpr int kMaxRounds = 16;

}  // namespace

CanBus::CanBus(std::int64_t bitrate, std::vector<Unit> units, std::uint64_t seed)
    : configured_(bitrate), units_(std::move(units)), to_host_(units_.size()), random_(seed), host_(bitrate) {}

std::int64_t CanBus::RateOf(const SimulatedCanNode& node) const {
  return node.bitrate() == 0 ? configured_ : node.bitrate();
}

bool CanBus::Broadcast(const SimulatedCanNode* from, std::int64_t rate, const CanFrame& frame, MonoNs now) {
  bool acknowledged = false;
  for (Unit& unit : units_) {
    if (unit.node.get() == from || !unit.node->present() || RateOf(*unit.node) != rate) continue;
    acknowledged = true;
    unit.node->OnFrame(frame, now);
  }
  return acknowledged;
}

bool CanBus::OnFrame(const CanFrame& frame, MonoNs now, const Transmit& transmit) {
  OnDue(now, transmit);
  const bool acknowledged = Broadcast(nullptr, host_, frame, now);
  ++(acknowledged ? host_frames_ : unacknowledged_);
  return acknowledged;
}

MonoNs CanBus::NextDue() const {
  MonoNs due = kNever;
  for (const Unit& unit : units_) due = std::min(due, unit.node->NextDue());
  for (const ToHost& way : to_host_) due = std::min(due, way.held.empty() ? kNever : way.held.front().due);
  return due;
}

void CanBus::OnDue(MonoNs now, const Transmit& transmit) {
  for (int round = 0; round < kMaxRounds && NextDue() <= now; ++round) {
    for (std::size_t unit = 0; unit < units_.size(); ++unit) Serve(unit, now, transmit);
  }
}

void CanBus::Serve(std::size_t unit, MonoNs now, const Transmit& transmit) {
  SimulatedCanNode& node = *units_[unit].node;
  ToHost& way = to_host_[unit];
  node.OnDue(now, [&](const CanFrame& frame) {
    const std::int64_t rate = RateOf(node);
    const bool taken = Broadcast(&node, rate, frame, now);
    if (rate == host_) {
      const bool late = node.fault().kind == SimulatedFault::Kind::kLate;
      way.held.push_back({way.adapter.Due(now, late ? node.fault() : SimulatedFault{}, random_), ToPacket(frame)});
    } else if (!taken) {
      ++unheard_;
    }
  });
  for (; !way.held.empty() && way.held.front().due <= now; way.held.pop_front()) transmit(way.held.front().packet);
}

Result<> CanBus::Set(std::string_view device, std::string_view key, std::string_view value, MonoNs now) {
  const auto unit =
      std::find_if(units_.begin(), units_.end(), [&](const Unit& candidate) { return candidate.name == device; });
  if (unit == units_.end()) return Failure("no simulated device '" + std::string(device) + "' here");
  unit->node->Advance(now);
  const Result<> done = unit->node->Set(key, value);
  if (!done) return Failure(unit->name + '.' + std::string(key) + ": " + done.error().text);
  return {};
}

std::vector<std::pair<std::string, std::string>> CanBus::State(std::string_view device, MonoNs now) const {
  const auto unit =
      std::find_if(units_.begin(), units_.end(), [&](const Unit& candidate) { return candidate.name == device; });
  if (unit == units_.end()) return {};
  auto list = unit->node->State(now);
  list.emplace_back("host_frames", std::to_string(host_frames_));
  list.emplace_back("unacknowledged", std::to_string(unacknowledged_));
  list.emplace_back("unheard", std::to_string(unheard_));
  return list;
}

}  // namespace axlecast::saa_can
