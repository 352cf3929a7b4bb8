// Hours of the whole machine of tests/simulation in virtual time, with faults of every kind drawn by a seed. A seed that breaks a promise
// is repeated with fewer and fewer faults, and printed as a short story.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cinttypes>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "platform/os/system_clock.h"
#include "tests/simulation/shrink.h"
#include "tests/simulation/simulated_machine.h"

namespace axlecast::simulation {
namespace {

struct Order {
  double hours = 0;
  std::uint64_t seed = 1;
  double minutes = 10;  // of each seed
  int stories = 3;      // after so many seeds with a breach, it ends
  bool shrinks = true;
};

struct Sum {
  Promises::Counts counts;
  double hours = 0;
  std::int64_t breaches = 0;
  int stories = 0;
};

struct Ended {
  Promises::Counts counts;
  std::vector<std::string> breaches;
  std::int64_t breach_count = 0;
  double hours = 0;
};

Ended RunSeed(const MachineConfig& config, const Order& order, std::uint64_t seed,
              const std::vector<Fault>& faults) {
  SimulatedMachine machine(config, seed);
  std::string thrown;
  try {
    machine.Run(static_cast<MonoNs>(order.minutes * 60e9), faults);
  } catch (const std::exception& error) {
    thrown = Promises::TimeText(machine.now()) + "  " + error.what();
  }
  const Promises& promises = machine.promises();
  Ended ended{promises.counts(), promises.breaches(), promises.count(),
              static_cast<double>(machine.now()) / 3'600e9};
  if (!thrown.empty()) {
    ended.breaches.push_back(thrown);
    ++ended.breach_count;
  }
  return ended;
}

void TellStory(const MachineConfig& config, const Order& order, std::uint64_t seed,
               const std::vector<Fault>& faults) {
  const auto fails = [&](const std::vector<Fault>& fewer) {
    return RunSeed(config, order, seed, fewer).breach_count > 0;
  };
  const std::vector<Fault> story = order.shrinks ? Shrink(faults, fails) : faults;
  std::printf("seed %" PRIu64 " with %zu of its %zu faults:\n", seed, story.size(), faults.size());
  std::vector<std::string> lines;
  lines.reserve(story.size());
  for (const Fault& fault : story) lines.push_back(FaultText(fault));
  for (const std::string& breach : RunSeed(config, order, seed, story).breaches)
    lines.push_back(breach + "  <-- breach");
  std::sort(lines.begin(), lines.end());
  for (const std::string& line : lines) std::printf("  %s\n", line.c_str());
}

int Report(const Sum& sum, double seconds) {
  for (const auto& [what, number] : sum.counts) std::printf("  %12" PRId64 "  %s\n", number, what.c_str());
  const auto kinds = std::count_if(sum.counts.begin(), sum.counts.end(),
                                   [](const auto& entry) { return entry.first.starts_with("fault: "); });
  const auto faults = sum.counts.find("faults");
  std::printf("%.2f machine-hours in %.1f s: %.0f hours per hour; %" PRId64 " faults of %lld kinds; %" PRId64
              " breaches\n",
              sum.hours, seconds, sum.hours * 3'600 / seconds, faults == sum.counts.end() ? 0 : faults->second,
              static_cast<long long>(kinds), sum.breaches);
  return sum.breaches == 0 ? 0 : 1;
}

int Main(int argc, char** argv) {
  Order order;
  CLI::App app{"The whole machine in virtual time, with faults of every kind."};
  app.footer(
      "example: whole_machine_in_virtual_time 1 --seed 7\n"
      "Exit codes: 0 no breach, 1 a breach, 2 usage.");
  app.add_option("HOURS", order.hours, "Machine-hours")->required()->check(CLI::PositiveNumber);
  app.add_option("--seed", order.seed, "The first seed")->capture_default_str();
  app.add_option("--minutes", order.minutes, "Minutes of each seed with faults")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--stories", order.stories, "Seeds with a breach after which it ends")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_flag("!--no-shrink", order.shrinks, "Print a breach with all faults of its seed, at once");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  const MachineConfig config = ReadSimulatedMachine();
  Sum sum;
  const SystemClock clock;
  const MonoNs began = clock.Now();
  for (std::uint64_t seed = order.seed; sum.hours < order.hours && sum.stories < order.stories; ++seed) {
    const std::vector<Fault> faults = DrawFaults(
        seed, SimulatedMachine::kRunIn, SimulatedMachine::kRunIn + static_cast<MonoNs>(order.minutes * 60e9));
    const Ended ended = RunSeed(config, order, seed, faults);
    for (const auto& [what, number] : ended.counts) sum.counts[what] += number;
    sum.hours += ended.hours;
    sum.breaches += ended.breach_count;
    if (ended.breach_count == 0) continue;
    ++sum.stories;
    TellStory(config, order, seed, faults);
    std::fflush(stdout);
  }
  return Report(sum, static_cast<double>(clock.Now() - began) * 1e-9);
}

}  // namespace
}  // namespace axlecast::simulation

int main(int argc, char** argv) { return axlecast::simulation::Main(argc, argv); }
