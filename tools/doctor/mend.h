#pragma once

#include <string>

#include "drivers/io/host_files.h"
#include "tools/doctor/finding.h"

namespace axlecast {

// Does what LineOf(remedy) says, on the host whose files these are. Empty when done, else why not. What can only be told
// is left alone.
[[nodiscard]] std::string Apply(const Remedy& remedy, const HostFiles& files);

}  // namespace axlecast
