#include "tests/product_code/product.h"

namespace axlecast {

int Doubled(int value) { return 2 * value; }

}  // namespace axlecast
