// Clients, bridge and drivers in virtual time, on a network that loses, doubles and reorders, while they are killed:
// many commands, each judged by what was really done to its device.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cinttypes>
#include <cstdint>
#include <cstdio>
#include <map>
#include <string>

#include "tests/command_simulation/world.h"

namespace axlecast {
namespace {

struct Order {
  std::int64_t count = 0;
  std::uint32_t seed = 1;
  std::uint32_t per_seed = 5'000;
  WorldSettings world;
};

struct Sum {
  std::map<std::string, std::int64_t> outcomes;
  std::map<std::string, std::int64_t> reasons;
  std::int64_t effects = 0;
  std::int64_t bridge_kills = 0;
  std::int64_t driver_kills = 0;
  std::int64_t breaches = 0;
};

void RunSeed(const Order& order, std::uint32_t seed, std::uint32_t count, Sum& sum) {
  WorldSettings settings = order.world;
  settings.seed = seed;
  World world(settings);
  const bool ended = world.Run(count);
  const WorldTally tally = world.Judge();
  for (const auto& [outcome, number] : tally.outcomes) sum.outcomes[outcome] += number;
  for (const auto& [reason, number] : tally.reasons) sum.reasons[reason] += number;
  sum.effects += tally.effects;
  sum.bridge_kills += tally.bridge_kills;
  sum.driver_kills += tally.driver_kills;
  sum.breaches += static_cast<std::int64_t>(tally.breaches.size()) + (ended ? 0 : 1);
  if (!ended) std::printf("  seed %" PRIu32 ": it takes for ever\n", seed);
  for (const std::string& breach : tally.breaches) std::printf("  seed %" PRIu32 ": %s\n", seed, breach.c_str());
}

int Report(const Order& order, const Sum& sum) {
  const NetworkSettings& network = order.world.network;
  std::printf("%" PRId64 " commands; of messages %.0f %% lost, %.0f %% doubled, each up to %d ms late\n",
              order.count, network.loss * 100, network.duplication * 100, network.max_delay_ms);
  std::printf("killed: the bridge %" PRId64 " times, drivers %" PRId64 " times, %.0f %% of the clients\n",
              sum.bridge_kills, sum.driver_kills, order.world.client_kills * 100);
  for (const auto& [outcome, number] : sum.outcomes) std::printf("  %10" PRId64 "  %s\n", number, outcome.c_str());
  std::printf("  %10" PRId64 "  effects on devices\n", sum.effects);
  std::printf("why the others did not succeed:\n");
  for (const auto& [reason, number] : sum.reasons) std::printf("  %10" PRId64 "  %s\n", number, reason.c_str());
  std::printf("%" PRId64 " breaches of: at most one effect, one outcome, in agreement with the device\n",
              sum.breaches);
  return sum.breaches == 0 ? 0 : 1;
}

int Main(int argc, char** argv) {
  Order order;
  WorldSettings& world = order.world;
  world.network = {.loss = 0.3, .duplication = 0.1, .max_delay_ms = 30};
  world.driver_kills_per_s = 0.05;
  world.bridge_kills_per_s = 0.1;
  world.client_kills = world.cancels = world.short_lived = world.reads = 0.05;
  CLI::App app{"Commands in virtual time, each judged by what was really done to its device."};
  app.footer("Exit codes: 0 no breach, 1 a breach, 2 usage.");
  app.add_option("COUNT", order.count, "Commands")->required()->check(CLI::PositiveNumber);
  app.add_option("--seed", order.seed, "The first seed")->capture_default_str();
  app.add_option("--per-seed", order.per_seed, "Commands of each seed")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--loss", world.network.loss, "Share of messages")
      ->check(CLI::Range(0.0, 0.9))
      ->capture_default_str();
  app.add_option("--duplication", world.network.duplication, "Share of messages")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  app.add_option("--delay", world.network.max_delay_ms, "ms at most: reorders")
      ->check(CLI::Range(0, 1'000))
      ->capture_default_str();
  app.add_option("--bridge-kills", world.bridge_kills_per_s, "A second")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  app.add_option("--driver-kills", world.driver_kills_per_s, "A second, of each")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  Sum sum;
  std::int64_t left = order.count;
  for (std::uint32_t seed = order.seed; left > 0; ++seed) {
    const std::int64_t part = std::min<std::int64_t>(left, order.per_seed);
    RunSeed(order, seed, static_cast<std::uint32_t>(part), sum);
    left -= part;
  }
  return Report(order, sum);
}

}  // namespace
}  // namespace axlecast

int main(int argc, char** argv) { return axlecast::Main(argc, argv); }
