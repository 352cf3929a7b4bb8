#include "drivers/kit/simulation/quantity_text.h"

#include <charconv>
#include <sstream>

namespace axlecast {

std::string ReadNumber(std::string_view text, double min, double max, std::string_view unit, double& into) {
  double value = 0;
  const char* const end = text.data() + text.size();
  const auto [stopped, error] = std::from_chars(text.data(), end, value);
  // The comparison refuses NaN too.
  if (error == std::errc() && stopped == end && value >= min && value <= max) {
    into = value;
    return {};
  }
  std::string problem =
      "'" + std::string(text) + "' is not a number from " + NumberText(min) + " to " + NumberText(max);
  if (!unit.empty()) problem.append(" ").append(unit);
  return problem;
}

std::string NumberText(double value) {
  std::ostringstream text;
  text.precision(12);
  text << value;
  return text.str();
}

}  // namespace axlecast
