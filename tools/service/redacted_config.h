#pragma once

#include <string>

namespace axlecast {

// A machine's file for other eyes: its keys and values without comments (which may hold anything), and in place of what
// stands under a key that speaks of a password, secret or token, "(masked)"; also of users in URLs. Where a mapping says
// where a secret is kept (file, credential), the place stays. Text that is no YAML gives a note instead of its content.
[[nodiscard]] std::string RedactedConfig(const std::string& text);

}  // namespace axlecast
