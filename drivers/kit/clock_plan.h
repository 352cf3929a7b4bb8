#pragma once

#include <cstdint>

#include "core/base/time.h"

namespace axlecast {

// A line on which the host's clock goes out over a cable and an encoder's data comes back with it, over drivers as
// TIA/EIA-422 has them (RS-422). The makers' SSI descriptions are where its rules are written down.
struct ClockedLine {
  double cable_m = 0;
  double cable_ns_per_m = 6.5;     // specific transit time of TWK's cable (TWK SSI 11.3)
  double encoder_delay_ns = 150;   // t_C: the encoder's electronics, at most (TWK SSI 11.3)
  double receiver_delay_ns = 150;  // t_E: the host's clock driver and data receiver, at most (TWK SSI 11.3)
  MonoNs monoflop = 0;             // the shortest that it can be; 0: not told
  double least_hz = 0;             // what the encoder takes, beyond what follows from the rest; 0: not told
  double most_hz = 0;
};

// What its clock can be. A clock is good when it lies between two of these, equal to neither.
struct ClockPlan {
  double delay_ns = 0;    // t_TD, from an edge of the clock to its effect on the data, both at the host
  double lowest_hz = 0;   // t_T < t_M (min): TWK SSI 10
  double highest_hz = 0;  // of the encoder and the cable: for reading that is delayed to fit
  double highest_half_cycle_hz =
      0;                           // where data is sampled half a cycle after the edge that brought it, as SPI does
  std::int64_t half_cycle_hz = 0;  // a good one for that; 0: none is
};
[[nodiscard]] ClockPlan PlanClock(const ClockedLine& line);

// When reading in may happen after the edge that asked for the bit: t_TD < t_EV < t_TD + t_T (TWK SSI 11.4).
struct EvaluationDelay {
  double least_ns = 0;
  double best_ns = 0;
  double most_ns = 0;
};
[[nodiscard]] EvaluationDelay PlanEvaluation(const ClockPlan& plan, double clock_hz);

}  // namespace axlecast
