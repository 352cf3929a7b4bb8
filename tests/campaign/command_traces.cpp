// Worlds of two commands to one device, with kills at any moment on a bad network: prints the events of each world, for
// tests/model. Fails on a breach of what tests/command_simulation judges.
#include <cinttypes>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>

#include "tests/command_simulation/world.h"

namespace axlecast {
namespace {

constexpr std::uint32_t kCommands = 2;
constexpr int kTransitions = 80;  // of a bridge, of which a kill is drawn; of a driver

WorldSettings Scene(std::uint32_t seed) {
  return {.seed = seed,
          .network = {.loss = 0.3, .duplication = 0.1, .max_delay_ms = 30},
          .buses = 1,
          .devices_per_bus = 1,
          .driver_kills_per_s = 0.05,
          .bridge_kills_per_s = 0.1,
          .client_kills = 0.1,
          .cancels = 0.3,
          .short_lived = 0.15,
          .traced = true};
}

// Returns the breaches.
std::size_t RunOne(std::uint32_t seed) {
  World world(Scene(seed));
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> transition(0, kTransitions);
  if (random() % 2 == 0) world.bridge_faults.KillAt(transition(random));
  if (random() % 2 == 0) world.driver_faults("b0").KillAt(transition(random) / 2);
  const bool ended = world.Run(kCommands);
  std::printf("trace %" PRIu32 "\n", seed);
  for (const std::string& line : world.trace().lines()) std::printf("%s\n", line.c_str());
  const WorldTally tally = world.Judge();
  for (const std::string& breach : tally.breaches) {
    std::fprintf(stderr, "seed %" PRIu32 ": %s\n", seed, breach.c_str());
  }
  return tally.breaches.size() + (ended ? 0 : 1);
}

}  // namespace
}  // namespace axlecast

int main(int argc, char** argv) {
  const int count = argc == 2 ? std::atoi(argv[1]) : 0;
  if (count < 1) {
    std::fprintf(stderr, "usage: command_traces COUNT\n");
    return 2;
  }
  std::size_t breaches = 0;
  for (int seed = 1; seed <= count; ++seed) breaches += axlecast::RunOne(static_cast<std::uint32_t>(seed));
  return breaches == 0 ? 0 : 1;
}
