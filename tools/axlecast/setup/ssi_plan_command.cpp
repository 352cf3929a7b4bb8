#include <CLI/CLI.hpp>
#include <cmath>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <type_traits>

#include "core/device/operation.h"
#include "core/messages/json/field.h"
#include "drivers/kit/clocked_line.h"
#include "tools/axlecast/common/subcommands.h"
#include "tools/axlecast/common/terminal.h"

namespace axlecast {
namespace {

struct SsiQuestion {
  ClockedLine line;
  int bits = 0;         // of the data word
  MonoNs pause = 0;     // minimum, between two readings
  double clock_hz = 0;  // 0: the plan selects it
};

struct SsiPlan {
  ClockPlan limits;
  double clock_hz = 0;           // requested or selected; 0: no clock is valid
  bool half_cycle_fits = false;  // valid for SPI, which samples half a cycle after the edge
  bool delayed_fits = false;     // valid if the evaluation is delayed accordingly
  EvaluationDelay evaluation;    // at that clock
  int clocks = 0;                // of one reading, in whole bytes
  double reading_us = 0;         // with the pause; 0: no clock
};

double Us(MonoNs time) { return static_cast<double>(time) / 1e3; }

// Returns what to change if the clock is not valid for SPI.
std::string Remedy(const SsiPlan& plan) {
  if (plan.half_cycle_fits) return "";
  if (plan.clock_hz == 0) return "no clock is above the lowest and below the highest: shorten the cable";
  if (plan.clock_hz <= plan.limits.lowest_hz) return "too slow: the monoflop runs down within the word";
  return plan.delayed_fits ? "too fast for SPI: data comes later than half a cycle; read in later, or clock slower"
                           : "too fast for this line";
}

SsiPlan MakeSsiPlan(const SsiQuestion& question) {
  SsiPlan plan;
  plan.limits = PlanClock(question.line);
  plan.clock_hz = question.clock_hz > 0 ? question.clock_hz : static_cast<double>(plan.limits.half_cycle_hz);
  // TWK SSI 2: n + 1 clocks for n bits.
  plan.clocks = (question.bits + 1 + 7) / 8 * 8;
  if (plan.clock_hz <= 0) return plan;
  const bool fast_enough = plan.clock_hz > plan.limits.lowest_hz;
  plan.half_cycle_fits = fast_enough && plan.clock_hz < plan.limits.highest_half_cycle_hz;
  plan.delayed_fits = fast_enough && plan.clock_hz <= plan.limits.highest_hz;
  plan.evaluation = PlanEvaluation(plan.limits, plan.clock_hz);
  plan.reading_us = plan.clocks * 1e6 / plan.clock_hz + Us(question.pause);
  return plan;
}

std::string SsiPlanText(const SsiQuestion& question, const SsiPlan& plan) {
  const ClockedLine& line = question.line;
  const ClockPlan& limits = plan.limits;
  std::string text;
  text += Text("line                %g m of cable, %g ns/m; encoder %g ns, driver and receiver %g ns\n",
               line.cable_m, line.cable_ns_per_m, line.encoder_delay_ns, line.receiver_delay_ns);
  text += Text("delay               %.0f ns from an edge of the clock to its bit\n", limits.delay_ns);
  text += Text("lowest clock        %.0f Hz (monoflop %g us)\n", limits.lowest_hz, Us(line.monoflop));
  text += Text("highest clock       %.0f Hz over SPI (spidev), sampled half a cycle after the edge\n",
               limits.highest_half_cycle_hz);
  text += Text("                    %.0f Hz where reading in is delayed\n", limits.highest_hz);
  if (plan.clock_hz > 0) {
    text += Text("clock               %.0f Hz, a cycle of %.2f us%s%s\n", plan.clock_hz, 1e6 / plan.clock_hz,
                 question.clock_hz > 0 ? "" : " (chosen)", plan.half_cycle_fits ? ": right for SPI" : "");
    text += Text("evaluation delay    %.0f ns to %.0f ns after the edge, best %.0f ns\n", plan.evaluation.least_ns,
                 plan.evaluation.most_ns, plan.evaluation.best_ns);
    text +=
        Text("one reading         %d clocks for %d bits, %.0f us with a pause of %g us: at most %.0f a second\n",
             plan.clocks, question.bits, plan.reading_us, Us(question.pause), 1e6 / plan.reading_us);
  }
  if (const std::string remedy = Remedy(plan); !remedy.empty())
    text += Text("not right for SPI   %s\n", remedy.c_str());
  return text;
}

nlohmann::ordered_json SsiPlanJson(const SsiQuestion& question, const SsiPlan& plan) {
  const ClockPlan& limits = plan.limits;
  nlohmann::ordered_json json = {{"ok", plan.half_cycle_fits},
                                 {"cable_m", question.line.cable_m},
                                 {"bits", question.bits},
                                 {"delay_ns", limits.delay_ns},
                                 {"lowest_hz", limits.lowest_hz},
                                 {"highest_hz", limits.highest_half_cycle_hz},
                                 {"highest_delayed_hz", limits.highest_hz},
                                 {"clocks", plan.clocks}};
  const bool known = plan.clock_hz > 0;
  const auto put = [&](const char* key, double value) {
    json[key] = known ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
  };
  put("clock_hz", plan.clock_hz);
  json["delayed_ok"] = plan.delayed_fits;
  put("evaluation_least_ns", plan.evaluation.least_ns);
  put("evaluation_best_ns", plan.evaluation.best_ns);
  put("evaluation_most_ns", plan.evaluation.most_ns);
  put("reading_us", plan.reading_us);
  return json;
}

struct SsiPlanOptions {
  SsiQuestion question;
  double monoflop_us = 15;
  double pause_us = 25;
  bool json = false;
};

constexpr const char* kExamples =
    "Defaults are those of TWK's description: monoflop 15 to 25 us, 150 ns each for the encoder and for driver\n"
    "and receiver, 6.5 ns/m. An SAA encoder: --min-clock 100000 --max-clock 250000 --monoflop-us 0 --pause-us "
    "500.\n"
    "Exit code: 0 the clock is right for SPI, 1 it is not, or no clock is, 2 usage.\n"
    "\n"
    "Examples:\n"
    "  axlecast ssi-plan --cable 200 --bits 25\n"
    "  axlecast ssi-plan --cable 200 --bits 25 --clock 300000     # for delayed reading only\n"
    "  axlecast ssi-plan --cable 50 --bits 12 --monoflop-us 10 --json | jq .highest_hz";

int PlanSsi(const SsiPlanOptions& options) {
  SsiQuestion question = options.question;
  question.line.monoflop = std::llround(options.monoflop_us * 1e3);
  question.pause = std::llround(options.pause_us * 1e3);
  const SsiPlan plan = MakeSsiPlan(question);
  std::cout << (options.json ? JsonLine(SsiPlanJson(question, plan)) + '\n' : SsiPlanText(question, plan));
  return plan.half_cycle_fits ? kExitDone : kExitBad;
}

}  // namespace

void AddSsiPlanCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<SsiPlanOptions>();
  ClockedLine& line = options->question.line;
  CLI::App* command =
      app.add_subcommand("ssi-plan", "Calculate the clock that an SSI line allows: delay, limits, evaluation time");
  const auto add = [command](const char* name, auto& value, const char* help, double min, double max) {
    using Value = std::remove_reference_t<decltype(value)>;
    const CLI::Range range(static_cast<Value>(min), static_cast<Value>(max));
    return command->add_option(name, value, help)->check(range)->capture_default_str();
  };
  add("--cable", line.cable_m, "Length of the cable, m", 0, 10'000)->required()->default_str("");
  add("--bits", options->question.bits, "Bits of the data word", 1, 64)->required()->default_str("");
  add("--clock", options->question.clock_hz, "Check this clock, Hz; else one is selected", 1, 50e6)
      ->default_str("");
  add("--monoflop-us", options->monoflop_us, "Minimum monoflop time, us; 0: unknown", 0, 1e6);
  add("--pause-us", options->pause_us, "Pause between two readings, us: the maximum monoflop time", 0, 1e6);
  add("--cable-ns-per-m", line.cable_ns_per_m, "Transit time of the cable, ns/m", 3.3, 20);
  add("--encoder-delay-ns", line.encoder_delay_ns, "Delay of the encoder's electronics, ns", 0, 1e5);
  add("--receiver-delay-ns", line.receiver_delay_ns, "Delay of clock driver and data receiver, ns", 0, 1e5);
  add("--min-clock", line.least_hz, "The encoder's minimum clock, Hz", 0, 50e6)->default_str("");
  add("--max-clock", line.most_hz, "The encoder's maximum clock, Hz", 0, 50e6)->default_str("");
  command->add_flag("--json", options->json, "Print one JSON object");
  command->footer(kExamples);
  command->callback([options, &exit_code] { exit_code = PlanSsi(*options); });
}

}  // namespace axlecast
