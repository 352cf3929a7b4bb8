#pragma once

#include <span>
#include <string_view>

#include "core/device/parameter.h"

namespace axlecast::tsubaki_sc {

// The 55 settings of guideline 11, in the order of their addresses 0 to 54.
[[nodiscard]] std::span<const ParameterSpec> Parameters();
// Returns null if no parameter has this name.
[[nodiscard]] const ParameterSpec* FindParameter(std::string_view name);

}  // namespace axlecast::tsubaki_sc
