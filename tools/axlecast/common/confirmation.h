#pragma once

#include <string_view>

namespace axlecast {

// Whether the operator can be asked: standard input is a terminal. If not, says that `what` needs --yes.
[[nodiscard]] bool CanAsk(std::string_view what);

// Asks; only `y` or `yes` is true. Else says that nothing was done.
[[nodiscard]] bool Confirmed();

}  // namespace axlecast
