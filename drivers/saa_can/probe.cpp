#include "drivers/saa_can/probe.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>

#include "core/device/operation.h"
#include "drivers/saa_can/codec.h"

namespace axlecast::saa_can {
namespace {

constexpr MonoNs kListen = 2'500 * kMillisecond;  // two heartbeats of a second, 25 positions as delivered
constexpr int kMinFrames = 4;
constexpr std::uint32_t kHeartbeatBase = 0x700;    // CiA 301 7.2.8.3.2.2: boot-up and heartbeat of nodes 1 to 127
constexpr std::uint32_t kProcessDataBase = 0x180;  // its TPDO1
constexpr std::uint32_t kLastCanopenNode = 0x7F;

// 0 boot-up, 4 stopped, 5 operational, 127 pre-operational (CiA 301 Table 73).
bool IsHeartbeat(std::uint8_t state) { return state == 0 || state == 4 || state == 5 || state == 127; }

// The most bits that a position in these data bytes has; 0: these are no position.
int BitsOf(const std::array<std::uint8_t, 8>& bits) {
  const auto last = std::find_if(bits.rbegin(), bits.rend(), [](std::uint8_t byte) { return byte != 0; });
  const auto used = static_cast<std::size_t>(bits.rend() - last);
  if (used <= DataBytes(16)) return 16;
  if (used <= DataBytes(24)) return 24;
  return used <= DataBytes(kMaxBits) && bits[3] < 4 ? kMaxBits : 0;
}

int LeastBits(const std::array<std::uint8_t, 8>& bits) {
  std::uint32_t seen = 0;
  for (std::size_t i = 4; i-- > 0;) seen = seen << 8U | bits.at(i);
  return std::max(kMinBits, static_cast<int>(std::bit_width(seen)));
}

}  // namespace

double ListeningProbe::Heard::PeriodMs() const {
  return frames < 2 ? 0 : static_cast<double>(last - first) / 1e6 / (frames - 1);
}

bool ListeningProbe::Heard::IsSteady() const {
  return frames >= kMinFrames && static_cast<double>(longest_gap) / 1e6 <= 2 * PeriodMs();
}

ListeningProbe::ListeningProbe(MonoNs now) : until_(now + kListen), now_(now) {}

std::optional<Step> ListeningProbe::Next(MonoNs now) const {
  if (lost_ || now >= until_) return std::nullopt;
  return Step{.action = Listen{until_}};
}

void ListeningProbe::On(const Event& event) {
  lost_ = lost_ || event.kind == Event::Kind::kLinkDown;
  now_ = std::max(now_, event.received.last);
  const bool standard = event.id <= kCanStandardMask;  // with data, and no report of the controller's
  if (event.kind != Event::Kind::kFrame || !standard) return;
  Heard& heard = heard_[event.id];
  const MonoNs at = event.received.last;
  if (heard.frames == 0) {
    heard.first = at;
  } else {
    heard.longest_gap = std::max(heard.longest_gap, at - heard.last);
  }
  heard.last = at;
  ++heard.frames;
  heard.least_size = std::min(heard.least_size, event.bytes.size());
  for (std::size_t i = 0; i < std::min(event.bytes.size(), heard.bits.size()); ++i)
    heard.bits.at(i) |= event.bytes[i];
}

bool ListeningProbe::IsCanopen(std::uint32_t node) const {
  const auto beat = heard_.find(kHeartbeatBase + node);
  return beat != heard_.end() && beat->second.least_size == 1 && IsHeartbeat(beat->second.bits[0]);
}

std::optional<ProbeHit> ListeningProbe::Encoder(std::uint32_t node, const Heard& heard) const {
  const int bits = BitsOf(heard.bits);
  if (heard.frames < kMinFrames || heard.least_size < 2 || bits == 0) return std::nullopt;
  // From 181 on these are the identifiers of CANopen's process data too.
  const bool ours = kDataBase + node <= kProcessDataBase;
  ProbeHit finding;
  finding.confidence = ours && heard.IsSteady() ? Confidence::kLikely : Confidence::kPossible;
  finding.device = Text("SAA encoder on CAN, node 0x%02x", static_cast<unsigned>(node));
  finding.reason = Text("%d frames %03X#, one each %.4g ms, hold what could be a position%s", heard.frames,
                        static_cast<unsigned>(kDataBase + node), heard.PeriodMs(),
                        ours ? "" : "; so could those of a CANopen node");
  const auto period = std::max<std::int64_t>(1, std::llround(heard.PeriodMs()));
  finding.keys = {{"bits", std::to_string(bits)},
                  {"node", Text("0x%02x", static_cast<unsigned>(node))},
                  {"period_ms", std::to_string(period)}};
  finding.check = Text("bits: %d to %d by its frames; the encoder's label says which",
                       std::min(LeastBits(heard.bits), bits), bits);
  return finding;
}

ProbeHit ListeningProbe::CanopenNode(std::uint32_t node) const {
  const bool data = heard_.contains(kProcessDataBase + node);
  ProbeHit finding;
  finding.confidence = Confidence::kSure;
  finding.device = Text("CANopen node %u", static_cast<unsigned>(node));
  finding.reason =
      data ? "its heartbeat and process data were heard; whether it is an encoder after CiA 406, listening "
             "does not tell. If it is: model: cia406, and bits and turn_bits from its label"
           : "its heartbeat was heard; what it is, listening does not tell";
  return finding;
}

std::vector<ProbeHit> ListeningProbe::Findings() const {
  std::vector<ProbeHit> findings;
  for (const auto& [id, heard] : heard_) {
    const std::uint32_t node = id - kDataBase;
    if (id <= kDataBase || node > kMaxNode) continue;
    if (id > kProcessDataBase && IsCanopen(id - kProcessDataBase)) continue;
    if (std::optional<ProbeHit> finding = Encoder(node, heard)) findings.push_back(std::move(*finding));
  }
  for (std::uint32_t node = 1; node <= kLastCanopenNode; ++node) {
    if (IsCanopen(node)) findings.push_back(CanopenNode(node));
  }
  return findings;
}

double ListeningProbe::Progress() const {
  return 1 - static_cast<double>(std::clamp<MonoNs>(until_ - now_, 0, kListen)) / static_cast<double>(kListen);
}

}  // namespace axlecast::saa_can

namespace axlecast {

std::vector<ProbeTrial> saa_can_probe(const ProbeScope&) {
  ProbeTrial trial;
  trial.what = "positions of SAA encoders, CANopen nodes";
  trial.longest = saa_can::kListen;
  trial.make = [](MonoNs now) { return std::make_unique<saa_can::ListeningProbe>(now); };
  return {trial};
}

}  // namespace axlecast
