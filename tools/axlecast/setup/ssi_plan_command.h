#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "drivers/kit/clocked_line.h"

namespace axlecast {

// What `axlecast ssi-plan` is asked.
struct SsiPlanQuestion {
  ClockedLine line;
  int bits = 0;         // of the data word
  MonoNs pause = 0;     // between two readings, at least
  double clock_hz = 0;  // 0: the one that the plan chooses
};

// Its answer.
struct SsiPlan {
  ClockPlan limits;
  double clock_hz = 0;           // looked at: asked for, or chosen; 0: none is right
  bool half_cycle_fits = false;  // it is right for SPI, which samples half a cycle after the edge
  bool delayed_fits = false;     // it is right where reading in is delayed to fit
  EvaluationDelay evaluation;    // at that clock
  int clocks = 0;                // of one reading, in whole bytes
  double reading_us = 0;         // with the pause; 0: there is no clock
};
[[nodiscard]] SsiPlan MakeSsiPlan(const SsiPlanQuestion& question);

[[nodiscard]] std::string SsiPlanText(const SsiPlanQuestion& question, const SsiPlan& plan);
[[nodiscard]] nlohmann::ordered_json SsiPlanJson(const SsiPlanQuestion& question, const SsiPlan& plan);

}  // namespace axlecast
