// What a control loop pays for its permits: permit_cost KEY_FILE [SECONDS]
//
// A loop of 1 kHz calls Allow in each cycle, and Withdraw once a second. Prints the times of the calls in the loop's thread, and what
// the issuer's thread sent, as one JSON object.
#include <axlecast/permit_issuer.h>

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "bench/distribution.h"
#include "bench/monotonic.h"

int main(int argc, char** argv) {
  using axlecast::bench::MonotonicNow;
  if (argc < 2) return 2;
  axlecast::ClientSettings settings;
  settings.machine = "bench";
  settings.key_file = argv[1];
  axlecast::PermitIssuer issuer(settings);
  if (!issuer.state()) {
    std::fprintf(stderr, "%s\n", issuer.state().error().text.c_str());
    return 1;
  }
  const int cycles = (argc > 2 ? std::atoi(argv[2]) : 10) * 1'000;
  const std::vector<std::string> operations = {"zero_single_turn", "reset_turns_and_errors"};
  std::vector<std::int64_t> allows;
  std::vector<std::int64_t> withdrawals;
  std::int64_t next = MonotonicNow();
  for (int cycle = 0; cycle < cycles; ++cycle) {
    axlecast::bench::SleepUntil(next += 1'000'000);
    const bool withdraws = cycle % 1'000 == 999;
    const std::int64_t begin = MonotonicNow();
    if (withdraws) {
      issuer.Withdraw("axis1");
    } else {
      issuer.Allow("axis1", operations, 200);
    }
    (withdraws ? withdrawals : allows).push_back(MonotonicNow() - begin);
  }
  const auto totals = issuer.totals();
  std::printf("{");
  axlecast::bench::PrintDistribution("allow", allows);
  std::printf(", ");
  axlecast::bench::PrintDistribution("withdraw", withdrawals);
  std::printf(", \"sent\": %lld, \"expired\": %lld}\n", static_cast<long long>(totals.sent),
              static_cast<long long>(totals.expired));
}
