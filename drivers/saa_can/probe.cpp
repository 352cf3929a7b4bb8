#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <memory>

#include "core/device/operation.h"
#include "drivers/kit/listening_probe.h"
#include "drivers/saa_can/codec.h"
#include "drivers/saa_can/family.h"

namespace axlecast::saa_can {
namespace {

constexpr MonoNs kListen =
    2'500 * kMillisecond;  // two heartbeats of a second, 25 positions at the factory's period
constexpr int kMinFrames = 4;
constexpr std::uint32_t kHeartbeatBase = 0x700;    // CiA 301 7.2.8.3.2.2: boot-up and heartbeat of nodes 1 to 127
constexpr std::uint32_t kProcessDataBase = 0x180;  // its TPDO1
constexpr std::uint32_t kLastCanopenNode = 0x7F;

// The frames with one identifier.
struct Traffic {
  int frames = 0;
  MonoNs first = 0;
  MonoNs last = 0;
  MonoNs longest_gap = 0;
  std::size_t min_size = 8;
  std::array<std::uint8_t, 8> bits{};  // that were ever set, byte by byte

  void Add(Bytes data, MonoNs at) {
    if (frames++ == 0) first = last = at;
    longest_gap = std::max(longest_gap, at - last);
    last = at;
    min_size = std::min(min_size, data.size());
    for (std::size_t i = 0; i < std::min(data.size(), bits.size()); ++i) bits.at(i) |= data[i];
  }
  [[nodiscard]] double PeriodMs() const {
    return frames < 2 ? 0 : static_cast<double>(last - first) / 1e6 / (frames - 1);
  }
  [[nodiscard]] bool IsSteady() const {
    return frames >= kMinFrames && static_cast<double>(longest_gap) / 1e6 <= 2 * PeriodMs();
  }
  // 0 boot-up, 4 stopped, 5 operational, 127 pre-operational (CiA 301 Table 73).
  [[nodiscard]] bool IsHeartbeat() const {
    return min_size == 1 && (bits[0] == 0 || bits[0] == 4 || bits[0] == 5 || bits[0] == 127);
  }
  // Returns the maximum number of bits of a position in these data; 0 if they are no position.
  [[nodiscard]] int MaxBits() const {
    const auto unused = std::find_if(bits.rbegin(), bits.rend(), [](std::uint8_t byte) { return byte != 0; });
    const auto used = static_cast<std::size_t>(bits.rend() - unused);
    if (used <= DataBytes(16)) return 16;
    if (used <= DataBytes(24)) return 24;
    return used <= DataBytes(kMaxBits) && bits[3] < 4 ? kMaxBits : 0;
  }
  // Returns the number of bits that the highest position needs.
  [[nodiscard]] int MinBits() const {
    std::uint32_t seen = 0;
    for (std::size_t i = 4; i-- > 0;) seen = seen << 8U | bits.at(i);
    return std::max(kMinBits, static_cast<int>(std::bit_width(seen)));
  }
};

std::optional<ProbeHit> SaaEncoder(std::uint32_t node, const Traffic& traffic) {
  const int bits = traffic.MaxBits();
  if (traffic.frames < kMinFrames || traffic.min_size < 2 || bits == 0) return std::nullopt;
  // Identifiers from 181 on are those of CANopen's process data too.
  const bool ours = kDataBase + node <= kProcessDataBase;
  const std::string node_text = Text("0x%02x", static_cast<unsigned>(node));
  const auto period = std::max<std::int64_t>(1, std::llround(traffic.PeriodMs()));
  ProbeHit hit;
  hit.confidence = ours && traffic.IsSteady() ? Confidence::kLikely : Confidence::kPossible;
  hit.device = "SAA encoder on CAN, node " + node_text;
  hit.reason = Text("%d frames %03X#, one each %.4g ms, hold what could be a position%s", traffic.frames,
                    static_cast<unsigned>(kDataBase + node), traffic.PeriodMs(),
                    ours ? "" : "; so could those of a CANopen node");
  hit.keys = {{"bits", std::to_string(bits)}, {"node", node_text}, {"period_ms", std::to_string(period)}};
  hit.check = Text("bits: %d to %d by its frames; the encoder's label shows which",
                   std::min(traffic.MinBits(), bits), bits);
  return hit;
}

ProbeHit CanopenNode(std::uint32_t node, bool process_data) {
  ProbeHit hit;
  hit.confidence = Confidence::kSure;
  hit.device = Text("CANopen node %u", static_cast<unsigned>(node));
  hit.reason =
      process_data
          ? "its heartbeat and process data were received. They do not show whether it is an encoder of CiA "
            "406. If it is: model: cia406, and bits and turn_bits from its label"
          : "its heartbeat was received, which does not show what the node is";
  return hit;
}

class TrafficProbe final : public ListeningProbe {
 public:
  explicit TrafficProbe(MonoNs now) : ListeningProbe(now, kListen) {}

  [[nodiscard]] std::vector<ProbeHit> Findings() const override {
    std::vector<ProbeHit> hits;
    for (const auto& [id, traffic] : traffic_) {
      const std::uint32_t node = id - kDataBase;
      if (id <= kDataBase || node > kMaxNode || (id > kProcessDataBase && IsCanopen(id - kProcessDataBase)))
        continue;
      if (std::optional<ProbeHit> hit = SaaEncoder(node, traffic)) hits.push_back(std::move(*hit));
    }
    for (std::uint32_t node = 1; node <= kLastCanopenNode; ++node) {
      if (IsCanopen(node)) hits.push_back(CanopenNode(node, traffic_.contains(kProcessDataBase + node)));
    }
    return hits;
  }

 private:
  void Take(const Event& event) override {
    const bool standard = event.id <= kCanStandardMask;  // with data, and no report of the controller
    if (event.kind == Event::Kind::kFrame && standard) traffic_[event.id].Add(event.bytes, event.received.last);
  }
  [[nodiscard]] bool IsCanopen(std::uint32_t node) const {
    const auto heartbeat = traffic_.find(kHeartbeatBase + node);
    return heartbeat != traffic_.end() && heartbeat->second.IsHeartbeat();
  }

  std::map<std::uint32_t, Traffic> traffic_;  // by 11-bit identifier
};

}  // namespace
}  // namespace axlecast::saa_can

namespace axlecast {

std::vector<ProbeTrial> saa_can_probe(const ProbeScope&) {
  ProbeTrial trial;
  trial.what = "positions of SAA encoders, CANopen nodes";
  trial.longest = saa_can::kListen;
  trial.make = [](MonoNs now) { return std::make_unique<saa_can::TrafficProbe>(now); };
  return {trial};
}

}  // namespace axlecast
