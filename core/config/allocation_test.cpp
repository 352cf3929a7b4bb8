// Reading a machine's file costs each bus the same, however many there are. Counted are allocations: time would depend on
// the host.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>
#include <string>

#include "core/config/load.h"

namespace {

std::atomic<std::int64_t> allocations = 0;

}  // namespace

// Not inlined: a compiler that sees malloc and free in them takes them for a mismatched pair.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace axlecast {
namespace {

std::string MachineOf(int buses) {
  std::string text = "machine: press3\nbuses:\n";
  for (int i = 0; i < buses; ++i) {
    const std::string number = std::to_string(i);
    text += "  b" + number + ": {family: point, simulate: {speed_rpm: 60}, devices: {axis" + number +
            ": {unit: deg}}}\n";
  }
  return text;
}

// Of all that check-config and the simulators do with it.
std::int64_t AllocationsFor(int buses) {
  const std::string text = MachineOf(buses);
  const std::int64_t before = allocations;
  ConfigErrors errors("m.yaml");
  const auto machine = ParseConfig(text, errors);
  EXPECT_TRUE(machine) << errors.Text();
  if (!machine) return 0;
  SimulatorMaker maker(*machine, errors);
  for (const BusConfig& bus : machine->buses) EXPECT_NE(maker.Make(bus), nullptr);
  return allocations - before;
}

TEST(LoadConfig, CostsEachBusTheSame) {
  const std::int64_t few = AllocationsFor(20);
  const std::int64_t many = AllocationsFor(200);
  EXPECT_GT(few, 0);
  EXPECT_LT(many, 11 * few) << few << " allocations for 20 buses, " << many << " for 200";
}

}  // namespace
}  // namespace axlecast
