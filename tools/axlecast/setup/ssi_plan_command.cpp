#include "tools/axlecast/setup/subcommands.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <iostream>
#include <memory>

#include "core/messages/json/field.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/setup/ssi_plan.h"

namespace axlecast {
namespace {

struct SsiPlanOptions {
  SsiPlanQuestion question;
  double monoflop_us = 15;
  double pause_us = 25;
  bool json = false;
};

constexpr const char* kExamples =
    "Defaults are those of TWK's description: monoflop 15 to 25 us, 150 ns each for the encoder and for driver "
    "and\n"
    "receiver, 6.5 ns/m. An SAA encoder: --min-clock 100000 --max-clock 250000 --monoflop-us 0 --pause-us 500.\n"
    "Exit code: 0 the clock is right for SPI, 1 it is not, or none is, 2 usage.\n"
    "\n"
    "Examples:\n"
    "  axlecast ssi-plan --cable 200 --bits 25\n"
    "  axlecast ssi-plan --cable 200 --bits 25 --clock 300000     # for delayed reading only\n"
    "  axlecast ssi-plan --cable 50 --bits 12 --monoflop-us 10 --json | jq .highest_hz";

int PlanSsi(const SsiPlanOptions& options) {
  SsiPlanQuestion question = options.question;
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
      app.add_subcommand("ssi-plan", "Which clock an SSI line allows: delay, limits, when to read in");
  command->add_option("--cable", line.cable_m, "Length of the cable, m")
      ->required()
      ->check(CLI::Range(0.0, 10'000.0));
  command->add_option("--bits", options->question.bits, "Bits of the data word")
      ->required()
      ->check(CLI::Range(1, 64));
  command->add_option("--clock", options->question.clock_hz, "Look at this clock, Hz; else one is chosen")
      ->check(CLI::Range(1.0, 50e6));
  command->add_option("--monoflop-us", options->monoflop_us, "Shortest monoflop time, us; 0: not told")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  command->add_option("--pause-us", options->pause_us, "Pause between two readings, us: the longest monoflop time")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  command->add_option("--cable-ns-per-m", line.cable_ns_per_m, "Transit time of the cable, ns/m")
      ->check(CLI::Range(3.3, 20.0))
      ->capture_default_str();
  command->add_option("--encoder-delay-ns", line.encoder_delay_ns, "Delay of the encoder's electronics, ns")
      ->check(CLI::Range(0.0, 1e5))
      ->capture_default_str();
  command->add_option("--receiver-delay-ns", line.receiver_delay_ns, "Delay of clock driver and data receiver, ns")
      ->check(CLI::Range(0.0, 1e5))
      ->capture_default_str();
  command->add_option("--min-clock", line.least_hz, "The encoder's lowest clock, Hz")->check(CLI::Range(0.0, 50e6));
  command->add_option("--max-clock", line.most_hz, "The encoder's highest clock, Hz")->check(CLI::Range(0.0, 50e6));
  command->add_flag("--json", options->json, "One JSON object");
  command->footer(kExamples);
  command->callback([options, &exit_code] { exit_code = PlanSsi(*options); });
}

}  // namespace axlecast
