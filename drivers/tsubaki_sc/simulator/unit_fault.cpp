#include "drivers/tsubaki_sc/simulator/unit_fault.h"

#include <algorithm>

#include "drivers/kit/simulation/quantity.h"

namespace axlecast::tsubaki_sc::simulator {
namespace {

constexpr double kUsualWrongAddress = 17;  // no unit has it
constexpr double kUsualException = 4;

}  // namespace

std::string ParseUnitFault(std::string_view text, UnitFault& fault) {
  const std::size_t colon = text.find(':');
  std::string name(text.substr(0, colon));
  std::replace(name.begin(), name.end(), '-', '_');
  UnitFault parsed;
  const bool wrong_address = name == "wrong_address";
  if (wrong_address || name == "exception") {
    double amount = wrong_address ? kUsualWrongAddress : kUsualException;
    if (colon != std::string_view::npos) {
      std::string problem = ReadNumber(text.substr(colon + 1), 1, 255, "", amount);
      if (!problem.empty()) return problem;
    }
    (wrong_address ? parsed.wrong_address : parsed.exception) = static_cast<std::uint8_t>(amount);
  } else if (std::string problem = ParseFault(text, parsed.line); !problem.empty()) {
    return problem + ", wrong_address, exception";
  }
  fault = parsed;
  return {};
}

std::string UnitFaultText(const UnitFault& fault) {
  if (fault.wrong_address != 0) return "wrong_address:" + std::to_string(fault.wrong_address);
  if (fault.exception != 0) return "exception:" + std::to_string(fault.exception);
  return FaultText(fault.line);
}

}  // namespace axlecast::tsubaki_sc::simulator
