#pragma once

#include <string>

namespace axlecast {

// Returns an empty string if no other user decides where `path` leads: each symbolic link on its way, the last name
// included, belongs to this user or to root. Otherwise the problem and its remedy. What does not exist yet is no link.
[[nodiscard]] std::string ForeignLinkProblem(const std::string& path);

}  // namespace axlecast
