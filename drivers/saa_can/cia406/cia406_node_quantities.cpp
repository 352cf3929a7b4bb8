#include <algorithm>
#include <cmath>

#include "core/device/operation.h"
#include "drivers/kit/arguments.h"
#include "drivers/kit/simulation/quantity.h"
#include "drivers/kit/simulation/shaft.h"
#include "drivers/saa_can/cia406/cia406_node.h"

namespace axlecast::saa_can::cia406 {

// What can be set of a node.
struct NodeQuantities {
  using N = Cia406Node;
  using Text = std::string_view;
  using Kind = SimulatedFault::Kind;

  static const QuantityTable<N>& Table();

  // A frame that was hit by noise reaches nobody: its CRC is wrong, and it is sent again.
  static std::string SetFault(N& n, Text value) {
    SimulatedFault fault;
    std::string problem = ParseFault(value, fault);
    if (!problem.empty()) return problem;
    if (fault.kind == Kind::kBitFlip || fault.kind == Kind::kRequestFlip || fault.kind == Kind::kEcho) {
      return "CAN has no such fault: its controllers drop damaged frames and send them again; use intermittent";
    }
    if (fault.kind == Kind::kScattered) return kNotOnCan;
    n.fault_ = fault;
    n.encoder_.stuck = fault.kind == Kind::kStuck;
    n.encoder_.stuck_at = n.encoder_.shaft.At(n.now_).angle;
    return {};
  }
  static std::string SetPower(N& n, Text value) {
    if (value != "on" && value != "off" && value != "cycle")
      return "'" + std::string(value) + "' is none of on, off, cycle";
    if (value != "on") n.Power(false);
    if (value != "off") n.Power(true);
    return {};
  }
  static std::string SetObject(N& n, Text value) {
    std::string problem = n.dictionary_.Change(value);
    if (!problem.empty()) return problem;
    static_cast<void>(n.stored_.Change(value));
    n.RestartTimers(n.now_);
    return {};
  }
  // What is wrong stays wrong through a reset.
  static void PutBoth(N& n, std::uint16_t index, std::uint32_t value) {
    n.dictionary_.Put(index, 0, value);
    n.stored_.Put(index, 0, value);
  }
  static std::string SetBits(N& n, std::uint16_t index, Text value) {
    const auto bits = ParseWhole(value, 0, 0xFFFF);
    if (!bits) return "'" + std::string(value) + "' is no number from 0 to 0xFFFF";
    PutBoth(n, index, static_cast<std::uint32_t>(*bits));
    return {};
  }
  // The error register says what the code's class is; 0 ends the error.
  static std::string SetEmergency(N& n, Text value) {
    const auto code = ParseWhole(value, 0, 0xFFFF);
    if (!code) return "'" + std::string(value) + "' is no error code from 0 to 0xFFFF; 0: no error";
    n.emergency_ = static_cast<std::uint16_t>(*code);
    const unsigned kind = n.emergency_ >> 12U;
    const unsigned bit = kind >= 2 && kind <= 4 ? 1U << (kind - 1) : 0U;
    PutBoth(n, 0x1001, n.emergency_ == 0 ? 0U : 1U | bit);
    if (n.state_ == N::NodeState::kPreOperational || n.state_ == N::NodeState::kOperational) n.SendEmergency();
    return {};
  }
  static std::string SetNmt(N& n, Text value) {
    if (value != "pre_operational" && value != "operational" && value != "stopped") {
      return "'" + std::string(value) + "' is none of pre_operational, operational, stopped";
    }
    if (!n.present()) return "the node has no power";
    n.state_ = value == "stopped"       ? N::NodeState::kStopped
               : value == "operational" ? N::NodeState::kOperational
                                        : N::NodeState::kPreOperational;
    n.RestartTimers(n.now_);
    return {};
  }
  static std::string NmtText(const N& n) {
    switch (n.state_) {
      case N::NodeState::kOff:
        return "off";
      case N::NodeState::kBooting:
        return "booting";
      case N::NodeState::kStopped:
        return "stopped";
      case N::NodeState::kOperational:
        return "operational";
      case N::NodeState::kPreOperational:
        break;
    }
    return "pre_operational";
  }
};

const QuantityTable<Cia406Node>& NodeQuantities::Table() {
  static const QuantityTable<N> kTable = {
      {"bitrate", [](N& n, Text v) { return ReadNumber(v, 0, 1e6, "bit/s (0: as configured)", n.bitrate_); },
       [](const N& n) { return NumberText(n.bitrate_); }},
      {"boot_ms", [](N& n, Text v) { return ReadNumber(v, 0, 60'000, "ms", n.boot_ms_); },
       [](const N& n) { return NumberText(n.boot_ms_); }},
      {"answer_us", [](N& n, Text v) { return ReadNumber(v, 0, 1e7, "us", n.answer_us_); },
       [](const N& n) { return NumberText(n.answer_us_); }},
      {"processing_us", [](N& n, Text v) { return ReadNumber(v, 0, 1e6, "us", n.processing_us_); },
       [](const N& n) { return NumberText(n.processing_us_); }},
      {"save_ms", [](N& n, Text v) { return ReadNumber(v, 0, 60'000, "ms", n.save_ms_); },
       [](const N& n) { return NumberText(n.save_ms_); }},
      {"object", SetObject, nullptr},
      {"alarms", [](N& n, Text v) { return SetBits(n, 0x6503, v); },
       [](const N& n) { return axlecast::Text("0x%04X", n.dictionary_.Get(0x6503, 0)); }},
      {"warnings", [](N& n, Text v) { return SetBits(n, 0x6505, v); },
       [](const N& n) { return axlecast::Text("0x%04X", n.dictionary_.Get(0x6505, 0)); }},
      {"noise_counts", [](N& n, Text v) { return ReadNumber(v, 0, 1'000, "counts", n.encoder_.noise_counts); },
       [](const N& n) { return NumberText(n.encoder_.noise_counts); }},
      {"accel_rad_s2", [](N& n, Text v) { return OrderAcceleration(n.encoder_.shaft, v); },
       [](const N& n) { return NumberText(n.encoder_.shaft.acceleration_rad_s2()); }},
      {"motion", [](N& n, Text v) { return OrderMotion(n.encoder_.shaft, v, n.now_, n.motion_); },
       [](const N& n) { return n.motion_; }},
      {"speed_rpm", [](N& n, Text v) { return OrderSpeed(n.encoder_.shaft, v, n.now_, n.motion_); },
       [](const N& n) { return NumberText(n.encoder_.shaft.At(n.now_).speed_rpm); }},
      {"fault", SetFault, [](const N& n) { return FaultText(n.fault_); }},
      {"power", SetPower, [](const N& n) { return std::string(n.present() ? "on" : "off"); }},
      {"nmt", SetNmt, NmtText},
      {"emergency", SetEmergency, [](const N& n) { return axlecast::Text("0x%04X", unsigned{n.emergency_}); }},
  };
  return kTable;
}

const std::vector<std::string_view>& Cia406Node::QuantityNames() {
  static const std::vector<std::string_view> kNames = NamesOf(NodeQuantities::Table());
  return kNames;
}

Result<> Cia406Node::Set(std::string_view name, std::string_view value) {
  return SetByName(NodeQuantities::Table(), *this, name, value);
}

std::vector<std::pair<std::string, std::string>> Cia406Node::State(MonoNs now) const {
  Cia406Node there = *this;
  there.Advance(now);
  std::vector<std::pair<std::string, std::string>> list = Shown(NodeQuantities::Table(), there);
  list.emplace_back("angle_deg", NumberText(DegreesFromAngle(encoder_.shaft.At(there.now_).angle)));
  const std::uint32_t turn = std::uint32_t{1} << static_cast<unsigned>(there.setup_.bits);
  list.emplace_back("single_turn", std::to_string(encoder_.Position(there.now_) & (turn - 1)));
  list.emplace_back("position", std::to_string(encoder_.Position(there.now_)));
  const auto count = [&list](std::string_view name, std::int64_t value) {
    list.emplace_back(name, std::to_string(value));
  };
  count("positions", counters_.positions);
  count("syncs", counters_.syncs);
  count("requests", counters_.requests);
  count("aborts", counters_.aborts);
  count("aborted", counters_.aborted);
  count("overlapping", counters_.overlapping);
  count("ignored", counters_.ignored);
  count("resets", counters_.resets);
  count("presets", counters_.presets);
  count("saves", counters_.saves);
  return list;
}

}  // namespace axlecast::saa_can::cia406
