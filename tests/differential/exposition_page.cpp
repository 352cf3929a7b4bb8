// A page of Prometheus' text format with the samples that standard input orders, for test_outputs.py.
//
// Each line: two label values in hex ("-": empty), then "d" and the bits of a double in hex, or "i" and an integer.

#include <bit>
#include <cstdint>
#include <iostream>
#include <sstream>
#include <string>

#include "tools/metrics/metrics_text.h"

namespace {

std::string OfHex(const std::string& hex) {
  std::string text;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
    text += static_cast<char>(std::stoul(hex.substr(i, 2), nullptr, 16));
  return text;
}

}  // namespace

int main() {
  axlecast::Exposition page;
  page.Family("axlecast_sample", axlecast::Exposition::Type::kGauge, "Random samples.");
  for (std::string text; std::getline(std::cin, text);) {
    std::istringstream line(text);
    std::string bus;
    std::string kind;
    std::string form;
    std::string number;
    line >> bus >> kind >> form >> number;
    bus = OfHex(bus);
    kind = OfHex(kind);
    if (form == "d") {
      page.Add({{"bus", bus}, {"kind", kind}},
               std::bit_cast<double>(std::uint64_t{std::stoull(number, nullptr, 16)}));
    } else {
      page.Add({{"bus", bus}, {"kind", kind}}, std::int64_t{std::stoll(number)});
    }
  }
  std::cout << page.text();
  return std::cout.flush() ? 0 : 1;
}
