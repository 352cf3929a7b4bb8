// Any texts at all are the files of a machine or a list of errors: never a crash, never a hang. The document that they make
// together is the same machine as one text.

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "core/config/load.h"
#include "core/config/test_family.h"

namespace axlecast {

std::span<const Family* const> Families() { return test_family::Table(); }

}  // namespace axlecast

namespace {

struct File {
  std::string_view name;
  std::string_view begin;  // before the text of the fuzzer
  std::string text = {};
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::array<File, 4> files = {{{"m.yaml", "include: [a.yaml, b.yaml]\nmachine: m\n"},
                                {"a.yaml", "buses: {b0: {family: point, simulate: true, devices: {a: {}}}}\n"},
                                {"b.yaml", "include: [c/d.yaml]\n"},
                                {"c/d.yaml", ""}}};
  std::string_view rest(reinterpret_cast<const char*>(data), size);
  for (File& file : files) {  // a byte that no UTF-8 has ends the text of a file
    const std::string_view part = rest.substr(0, rest.find('\xFF'));
    rest.remove_prefix(std::min(rest.size(), part.size() + 1));
    file.text = std::string(file.begin) + std::string(part);
  }
  const axlecast::ConfigReader read = [&files](const std::string& name) -> axlecast::Result<std::string> {
    for (const File& file : files) {
      if (file.name == name) return file.text;
    }
    return axlecast::Failure("cannot be read: no such file");
  };
  axlecast::ConfigErrors errors("m.yaml");
  const auto machine = axlecast::LoadConfigFrom("m.yaml", read, errors);
  if (machine.has_value() != errors.empty()) __builtin_trap();
  if (!machine) return errors.Text().empty() ? __builtin_trap(), 0 : 0;
  axlecast::ConfigErrors of_copy("copy.yaml");
  const auto copy = axlecast::ParseConfig(machine->text, of_copy);
  if (!copy || copy->buses.size() != machine->buses.size()) __builtin_trap();
  for (std::size_t i = 0; i < copy->buses.size(); ++i) {
    if (copy->buses[i].name != machine->buses[i].name) __builtin_trap();
  }
  for (const axlecast::BusConfig& bus : machine->buses) {
    axlecast::ConfigErrors simulate("m.yaml");
    const auto simulator = axlecast::MakeSimulator(*machine, bus, simulate);
    if ((simulator != nullptr) != simulate.empty()) __builtin_trap();
  }
  return 0;
}
