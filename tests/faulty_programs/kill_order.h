#pragma once

#include <csignal>
#include <cstdio>
#include <cstdlib>

#include "tests/command_simulation/faults.h"

namespace axlecast {

// Kills this process, as kill -9 does, at its transition number $AXLECAST_KILL_AT; without it at no transition. Prints how many
// there were, at a clean end.
class KillOrder {
 public:
  KillOrder() {
    if (const char* at = std::getenv("AXLECAST_KILL_AT")) faults.KillAt(std::atoll(at));
  }
  ~KillOrder() { std::fprintf(stderr, "transitions: %lld\n", static_cast<long long>(faults.count())); }
  KillOrder(const KillOrder&) = delete;
  KillOrder& operator=(const KillOrder&) = delete;

  Faults faults{[] { static_cast<void>(std::raise(SIGKILL)); }};
};

}  // namespace axlecast
