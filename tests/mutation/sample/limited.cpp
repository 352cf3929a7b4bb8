#include "tests/mutation/sample/limited.h"

namespace axlecast {

int Limited(int value, int minimum, int maximum, bool& limited) {
  limited = true;
  if (value < minimum) return minimum;
  if (value > maximum) return maximum;
  limited = false;
  return value;
}

}  // namespace axlecast
