#pragma once

#include <functional>
#include <string_view>

#include "tools/log/log_event.h"

namespace axlecast {

// Shows every wanted event of a log, in order; as often as it is called, the same ones. It ends early where the visitor
// says false.
using EventVisitor = std::function<bool(const LogEvent&)>;
using EventRange = std::function<void(const EventVisitor&)>;

// Takes the next part of what is written. False: it cannot be written, and no more need be made.
using Output = std::function<bool(std::string_view)>;

}  // namespace axlecast
