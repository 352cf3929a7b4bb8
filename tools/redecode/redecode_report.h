#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "tools/redecode/log_redecoder.h"

namespace axlecast {

// What decoding a log again has shown: by bus what was read and where the capture has gaps; with `diff` also the
// comparison with the readings in the log.
[[nodiscard]] nlohmann::ordered_json ToJson(const LogRedecoder& redecoder, bool diff);
[[nodiscard]] std::string ToText(const LogRedecoder& redecoder, bool diff);

}  // namespace axlecast
