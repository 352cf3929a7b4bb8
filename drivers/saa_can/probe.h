#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "core/device/probe.h"

namespace axlecast::saa_can {

// Listens to a CAN bus: positions of SAA encoders on 1NN, heartbeats and process data of CANopen nodes. Sends nothing, so
// it works on an interface that only listens.
class ListeningProbe final : public Probe {
 public:
  explicit ListeningProbe(MonoNs now);

  [[nodiscard]] std::optional<Step> Next(MonoNs now) const override;
  void On(const Event& event) override;
  [[nodiscard]] std::vector<ProbeHit> Findings() const override;
  [[nodiscard]] double Progress() const override;

 private:
  // What came under one identifier.
  struct Heard {
    int frames = 0;
    MonoNs first = 0;
    MonoNs last = 0;
    MonoNs longest_gap = 0;
    std::size_t least_size = 8;
    std::array<std::uint8_t, 8> bits{};  // that were ever set, byte by byte

    [[nodiscard]] double PeriodMs() const;
    [[nodiscard]] bool IsSteady() const;
  };

  [[nodiscard]] bool IsCanopen(std::uint32_t node) const;
  [[nodiscard]] std::optional<ProbeHit> Encoder(std::uint32_t node, const Heard& heard) const;
  [[nodiscard]] ProbeHit CanopenNode(std::uint32_t node) const;

  MonoNs until_;
  MonoNs now_;
  bool lost_ = false;
  std::map<std::uint32_t, Heard> heard_;  // by 11-bit identifier
};

}  // namespace axlecast::saa_can

namespace axlecast {

// For FamilyProbes.
[[nodiscard]] std::vector<ProbeTrial> saa_can_probe(const ProbeScope& scope);

}  // namespace axlecast
