#pragma once

namespace axlecast {

// Returns the value within its limits. `limited` is set if the value was outside.
int Limited(int value, int minimum, int maximum, bool& limited);

}  // namespace axlecast
