#pragma once

namespace axlecast {

// Acts as product code in the tests of the check itself.
[[nodiscard]] int Doubled(int value);

}  // namespace axlecast
