// A campaign: replies that come up to ten timeouts late, and frames of streams that stall, always, for half of the time and
// rarely, on every bus of every family on which something can be late, in virtual time.
//
// Usage: late_replies_in_virtual_time EXCHANGES [FAMILY...]; prints a line of figures per bus and mix; exit 1 when the
// interval of a reading missed the instant at which the device had that value.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include "core/config/load.h"
#include "tests/conformance/late_replies.h"
#include "tests/support/fixed_secrets.h"

namespace axlecast {
namespace {

using Long = long long;  // as printf requires it

// Returns the number of readings, -1 if one missed.
std::int64_t Run(const MachineConfig& machine, const BusConfig& bus, LateMix mix, std::int64_t exchanges) {
  FixedSecrets secrets;
  secrets.any = "password";
  LateRun run(machine, bus, secrets, mix);
  run.Exchange(exchanges);
  std::printf("%s %s, %s: %lld exchanges, %lld readings, %lld outside their interval", bus.family->name.data(),
              bus.name.c_str(), MixName(mix), Long{run.exchanges()}, Long{run.readings()}, Long{run.missed()});
  if (run.missed() > 0) std::printf(", the worst by %lld us", Long{run.worst() / kMicrosecond});
  std::printf("\n");
  return run.missed() == 0 ? run.readings() : -1;
}

bool RunFamily(const Family& family, std::int64_t exchanges) {
  const std::string file = std::string(AXLECAST_SOURCE "/drivers/") + std::string(family.name) + "/example.yaml";
  ConfigErrors errors(file);
  const auto machine = LoadConfig(file, errors);
  if (!machine) {
    std::fputs(errors.Text().c_str(), stderr);
    return false;
  }
  bool good = true;
  for (const BusConfig& bus : machine->buses) {
    if (bus.late == 0) continue;
    std::int64_t readings = 0;
    for (const LateMix mix : kLateMixes) {
      const std::int64_t judged = Run(*machine, bus, mix, exchanges);
      good = judged >= 0 && good;
      readings += judged;
    }
    // Where every reply is late, a bus may have no reading at all.
    good = good && readings > 0;
  }
  return good;
}

}  // namespace
}  // namespace axlecast

int main(int argc, char** argv) {
  using namespace axlecast;
  const std::int64_t exchanges = argc > 1 ? std::atoll(argv[1]) : 0;
  if (exchanges <= 0) {
    std::fputs("usage: late_replies_in_virtual_time EXCHANGES [FAMILY...]\n", stderr);
    return 2;
  }
  bool good = true;
  for (const Family* family : Families()) {
    const bool wanted = argc == 2 || std::find(argv + 2, argv + argc, family->name) != argv + argc;
    if (wanted) good = RunFamily(*family, exchanges) && good;
  }
  return good ? 0 : 1;
}
