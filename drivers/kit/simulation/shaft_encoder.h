#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "drivers/kit/simulation/shaft.h"
#include "drivers/kit/simulation/simulated_fault.h"
#include "drivers/kit/simulation/unit_simulator.h"

namespace axlecast {

// Where a simulated shaft begins, and the seed of its random numbers.
struct ShaftStart {
  ShaftAngle angle = 0;
  std::uint64_t seed = 1;
};

// Reads the keys `seed`, `start_deg` and, if the encoder counts `turn_bits` of turns, `start_turns`.
[[nodiscard]] inline ShaftStart ReadShaftStart(ConfigMap& map, std::optional<int> turn_bits = std::nullopt) {
  ShaftStart start;
  start.seed = static_cast<std::uint64_t>(map.Integer("seed", 1, 0, INT64_MAX, ""));
  start.angle = AngleFromDegrees(map.Number("start_deg", 0, 0, 360, "deg"));
  if (turn_bits) {
    const std::int64_t max_turns = (std::int64_t{1} << *turn_bits) - 1;
    start.angle += map.Integer("start_turns", 0, 0, max_turns, "turns") * kShaftTurn;
  }
  return start;
}

// The common half of a simulated encoder with one shaft. A family derives its own struct. Its Table() returns what
// WithCommon adds to the family's own quantities.
template <typename Derived>
struct ShaftEncoder : TableDevice<Derived> {
  explicit ShaftEncoder(const ShaftStart& start) : shaft(start.angle), random(start.seed) {}

  void Advance(MonoNs to) override { now = std::max(now, to); }

  // Returns the angle that it measures at `at`, which may be a little later than the last Advance.
  [[nodiscard]] ShaftAngle Measured(MonoNs at) const {
    return fault.kind == SimulatedFault::Kind::kStuck ? stuck_at : shaft.At(at).angle;
  }
  // Returns the amount of the fault `slow`, in us.
  [[nodiscard]] double slow_us() const { return fault.kind == SimulatedFault::Kind::kSlow ? fault.amount : 0; }

  Shaft shaft;
  SeededRandom random;
  MonoNs now = 0;
  SimulatedFault fault;
  ShaftAngle stuck_at = 0;
  bool powered = true;

 protected:
  // Appends the quantities of every encoder. Power and motion come last: they begin after the rest of the mapping is set.
  // `check` refuses faults that have no meaning for the family; null if all have one.
  [[nodiscard]] static QuantityTable<Derived> WithCommon(QuantityTable<Derived> table,
                                                         Result<> (*check)(const SimulatedFault& fault) = nullptr) {
    table.push_back(AccelerationQuantity<Derived>(&Derived::shaft));
    table.push_back(MotionQuantity<Derived>(&Derived::shaft, &Derived::now));
    table.push_back(SpeedQuantity<Derived>(&Derived::shaft, &Derived::now));
    table.push_back({"fault",
                     [check](Derived& encoder, std::string_view text) -> Result<> {
                       const Result<SimulatedFault> parsed = ParseFault(text);
                       if (!parsed) return Failure(parsed.error());
                       const Result<> fits = check == nullptr ? Result<>() : check(*parsed);
                       if (!fits) return Failure("'" + std::string(text) + "'" + fits.error().text);
                       encoder.fault = *parsed;
                       encoder.stuck_at = encoder.shaft.At(encoder.now).angle;
                       return {};
                     },
                     [](const Derived& encoder) { return FaultText(encoder.fault); }});
    table.push_back(ChoiceQuantity<Derived>("power", &Derived::powered, {"off", "on"}));
    return table;
  }
};

}  // namespace axlecast
