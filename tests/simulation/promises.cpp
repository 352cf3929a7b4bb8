#include "tests/simulation/promises.h"

#include "core/base/text.h"

namespace axlecast::simulation {

std::string Promises::TimeText(MonoNs time) { return Text("%12.6f s", static_cast<double>(time) * 1e-9); }

}  // namespace axlecast::simulation
