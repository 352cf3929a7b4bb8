#pragma once

#include <string>

#include "tools/doctor/host/host_files.h"
#include "tools/doctor/symptom.h"

namespace axlecast {

// Does what LineOf(fix) says, on the host whose files these are. Empty when done, else why not. What can only be told
// is left alone.
[[nodiscard]] std::string Apply(const Fix& fix, const HostFiles& files);

}  // namespace axlecast
