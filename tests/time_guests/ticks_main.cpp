// Judges the ticks that tests/time_guests/run recorded in the case `tick`, and prints their figures.
//
//   ticks_check FOLDER [--least N] [--shift HALF_WIDTHS]
//
// Fails if a tick misses the truth, or if fewer than N ticks hold it, for any maker of sets. --shift moves the interval of each axis
// first: the check must then fail.
#include <CLI/CLI.hpp>
#include <cinttypes>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "tests/time_guests/figures.h"
#include "tests/time_guests/tick_judge.h"

namespace axlecast {
namespace {

void Print(const TickFigures& figures) {
  std::printf("sets made by %s: %s\n", figures.maker.c_str(), figures.phase.c_str());
  std::printf("  %-34s %6" PRId64 ", of which %" PRId64 " complete\n", "ticks", figures.ticks,
              figures.ticks - figures.incomplete);
  Print("complete ticks", figures.judged);
  std::printf(
      "  true spread p50 %.3f, max %.3f ms; hull p50 %.3f, max %.3f ms; truth from the middle of an axis p50 %.3f, "
      "max %.3f ms; known to %.3f us\n",
      Milliseconds(Percentile(figures.spreads, 50)), Milliseconds(Percentile(figures.spreads, 100)),
      Milliseconds(Percentile(figures.hulls, 50)), Milliseconds(Percentile(figures.hulls, 100)),
      Milliseconds(Percentile(figures.from_middles, 50)), Milliseconds(Percentile(figures.from_middles, 100)),
      static_cast<double>(figures.oracle_error) * 1e-3);
}

int Report(const std::vector<TickFigures>& figures, std::int64_t least) {
  std::int64_t judged = 0;
  std::int64_t missed = 0;
  for (const TickFigures& each : figures) {
    Print(each);
    judged += each.judged.holds + each.judged.misses;
    missed += each.judged.misses;
  }
  std::printf("%" PRId64 " ticks judged, %" PRId64 " miss the truth\n", judged, missed);
  if (!IsTrue(figures, least)) {
    std::printf("FAILED; %" PRId64 " ticks of each must be judged, and be true\n", least);
    return 1;
  }
  return 0;
}

}  // namespace
}  // namespace axlecast

int main(int argc, char** argv) {
  CLI::App app("Compares recorded ticks of axes on two guests with the truth");
  std::string folder;
  std::int64_t least = 1;
  double shift = 0;
  app.add_option("folder", folder, "What tests/time_guests/run recorded")->required();
  app.add_option("--least", least, "Fail if fewer ticks hold the truth");
  app.add_option("--shift", shift, "Move the interval of every axis by this number of its half widths first");
  CLI11_PARSE(app, argc, argv);
  const auto run = axlecast::ReadGuestRun(folder);
  if (!run) {
    std::fprintf(stderr, "%s\n", run.error().text.c_str());
    return 1;
  }
  return axlecast::Report(axlecast::JudgeTicks(*run, shift), least);
}
