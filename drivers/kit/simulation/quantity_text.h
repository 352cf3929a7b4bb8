#pragma once

#include <string>
#include <string_view>

namespace axlecast {

// A quantity of the simulator as text, in the file and at run time alike. ReadNumber: empty when `into` holds it,
// else what would be right.
[[nodiscard]] std::string ReadNumber(std::string_view text, double min, double max, std::string_view unit,
                                     double& into);
[[nodiscard]] std::string NumberText(double value);

}  // namespace axlecast
