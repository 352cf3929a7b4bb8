#pragma once

#include <optional>
#include <string>

#include "core/base/inline_bytes.h"
#include "core/config/machine_config.h"

namespace axlecast {

// The machine's file that a log begins with: a recorder writes it before all that it hears. Nothing where there is none
// or it cannot be used; `problem` then says why. `file`: the log's name, for that.
[[nodiscard]] std::optional<MachineConfig> MachineOf(Bytes log, const std::string& file, std::string& problem);

}  // namespace axlecast
