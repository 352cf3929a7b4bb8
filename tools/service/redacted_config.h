#pragma once

#include <string>

namespace axlecast {

// Returns a machine's file for third parties. Comments are removed. "(masked)" replaces the values below a key whose name
// contains a word like password, secret or token, and the users in URLs. The place of a secret (file, credential) is kept.
// Text that is no YAML is replaced by a note.
[[nodiscard]] std::string RedactedConfig(const std::string& text);

}  // namespace axlecast
