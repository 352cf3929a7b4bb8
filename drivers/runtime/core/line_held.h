#pragma once

#include <string_view>

namespace axlecast {

// How the answer of Link::Open ends while another process has the line.
inline constexpr std::string_view kLineHeld = "another process holds it: is a second driver running?";

}  // namespace axlecast
