// Any text at all is a machine's file or a list of errors: never a crash, never a hang.

#include <cstddef>
#include <cstdint>
#include <string>

#include "core/config/load.h"
#include "core/config/test_family.h"

namespace axlecast {

std::span<const Family* const> Families() { return test_family::Table(); }

}  // namespace axlecast

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  axlecast::ConfigErrors errors("f.yaml");
  const auto machine = axlecast::ParseConfig(text, errors);
  if (machine.has_value() != errors.empty()) __builtin_trap();
  if (!machine) return errors.Text().empty() ? __builtin_trap(), 0 : 0;
  for (const axlecast::BusConfig& bus : machine->buses) {
    axlecast::ConfigErrors simulate("f.yaml");
    const auto simulator = axlecast::MakeSimulator(*machine, bus, simulate);
    if ((simulator != nullptr) != simulate.empty()) __builtin_trap();
  }
  return 0;
}
