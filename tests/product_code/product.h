#pragma once

namespace axlecast {

// Stands for product code in the tests of the check itself.
[[nodiscard]] int Doubled(int value);

}  // namespace axlecast
