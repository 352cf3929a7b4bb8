// Judges what tests/time_guests/run recorded: prints the figures of each part of the test.
//
//   time_guests_check FOLDER [--least N] [--shift HALF_WIDTHS]
//
// Fails if an interval misses the truth, two instants are compared in the wrong order, or a claim is published 2 s after the cause of its
// end; or if fewer than N intervals of a guest that is not the root were judged, or no instants were compared. --shift moves
// every such interval first: the check must then fail.
#include <CLI/CLI.hpp>
#include <cinttypes>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "tests/time_guests/figures.h"
#include "tests/time_guests/judge.h"

namespace axlecast {
namespace {

void Print(const PhaseFigures& phase) {
  std::printf("%s\n", phase.name.c_str());
  Print("intervals published", phase.claims);
  Print("of the root's own clock", phase.own);
  Print("instants given to consumers", phase.instants);
  Print("while a limit was exceeded", phase.beyond);
  const Comparisons& order = phase.comparisons;
  if (order.right + order.wrong + order.undecided + order.unknown > 0) {
    std::printf("  %-34s %6" PRId64 " right, %" PRId64 " wrong, %" PRId64 " within the oracle's error; %" PRId64
                " not known\n",
                "orders of two instants", order.right, order.wrong, order.undecided, order.unknown);
  }
  if (!phase.half_widths.empty()) {
    std::printf(
        "  half width p50 %.3f, p99 %.3f, max %.3f ms; truth from the middle p50 %.3f, max %.3f ms; known to %.3f "
        "us\n",
        Milliseconds(Percentile(phase.half_widths, 50)), Milliseconds(Percentile(phase.half_widths, 99)),
        Milliseconds(Percentile(phase.half_widths, 100)), Milliseconds(Percentile(phase.from_middle, 50)),
        Milliseconds(Percentile(phase.from_middle, 100)), static_cast<double>(phase.oracle_error) * 1e-3);
  }
  Print("chronyd's claims of UNIX time", phase.utc);
  Print("these in TIME messages", phase.utc_published);
  if (!phase.utc_errors.empty()) {
    std::printf("  claimed p50 %.3f, max %.3f ms; true error p50 %.3f, max %.3f ms\n",
                Milliseconds(Percentile(phase.utc_half_widths, 50)),
                Milliseconds(Percentile(phase.utc_half_widths, 100)),
                Milliseconds(Percentile(phase.utc_errors, 50)), Milliseconds(Percentile(phase.utc_errors, 100)));
  }
  if (phase.last > 0) {
    std::printf("  last claim %.3f s after the cause of its end; later than 2 s + %.0f ms: %" PRId64 "\n",
                Milliseconds(phase.last) * 1e-3, Milliseconds(phase.starved), phase.late);
  }
}

// The counters of all guests run at one rate.
void PrintRates(const GuestRun& run) {
  const auto rate = [](const Guest& guest) {
    const ClockReading& first = guest.clocks.readings().front();
    const ClockReading& last = guest.clocks.readings().back();
    return static_cast<double>(last.raw - first.raw) / static_cast<double>(last.before - first.before);
  };
  for (const Guest& guest : run.guests) {
    std::printf("CLOCK_MONOTONIC_RAW of %s ran %+.1f ppm faster than that of %s\n", guest.name.c_str(),
                (rate(guest) / rate(run.guests.front()) - 1) * 1e6, run.guests.front().name.c_str());
  }
}

int Report(const std::vector<PhaseFigures>& phases, std::int64_t least) {
  std::int64_t judged = 0;
  std::int64_t missed = 0;
  Comparisons orders;
  for (const PhaseFigures& phase : phases) {
    Print(phase);
    judged += phase.claims.holds + phase.claims.misses;
    missed += phase.claims.misses;
    orders.right += phase.comparisons.right;
    orders.wrong += phase.comparisons.wrong;
  }
  std::printf("%" PRId64 " intervals, %" PRId64 " miss the truth; %" PRId64 " orders, %" PRId64 " wrong\n", judged,
              missed, orders.right + orders.wrong, orders.wrong);
  if (judged < least || orders.right == 0) {
    std::printf("FAILED: too little was judged to show anything; %" PRId64 " intervals are needed\n", least);
    return 1;
  }
  if (!IsTrue(phases)) std::printf("FAILED\n");
  return IsTrue(phases) ? 0 : 1;
}

}  // namespace
}  // namespace axlecast

int main(int argc, char** argv) {
  CLI::App app("Compares recorded time claims of two guests with the truth");
  std::string folder;
  std::int64_t least = 1;
  axlecast::JudgeOptions options;
  app.add_option("folder", folder, "What tests/time_guests/run recorded")->required();
  app.add_option("--least", least, "Fail if fewer intervals were judged");
  app.add_option("--shift", options.shift, "Move every interval by this number of its half widths first");
  CLI11_PARSE(app, argc, argv);
  auto run = axlecast::ReadGuestRun(folder);
  if (!run) {
    std::fprintf(stderr, "%s\n", run.error().text.c_str());
    return 1;
  }
  axlecast::PrintRates(*run);
  return axlecast::Report(axlecast::JudgeRun(std::move(*run), options), least);
}
