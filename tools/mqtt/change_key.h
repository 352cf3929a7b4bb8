#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/base/inline_bytes.h"

namespace axlecast {

// What of a message is worth telling anew when it has changed: a state without its counters and times, a position with its
// value and flags, a trip or an outcome as such.
struct ChangeKey {
  std::string mark;
  double value = 0;  // of a position, in its unit
};

// Nothing when the message is none of this type.
[[nodiscard]] std::optional<ChangeKey> NoveltyOf(std::string_view type, Bytes message);

// Whether `newer` says something else than `older`; values that are no further apart than `deadband` say the same.
[[nodiscard]] bool Differ(const ChangeKey& newer, const ChangeKey& older, double deadband);

}  // namespace axlecast
