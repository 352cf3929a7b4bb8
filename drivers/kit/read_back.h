#pragma once

#include <cstdint>
#include <string>

#include "core/device/operation.h"

namespace axlecast {

// What reading back proves. An outcome claims an effect only where the device would have read differently without the
// operation (docs/commands.md, "What verified means").
// What reads as it should after an operation, judged against what it read before.
struct ReadBack {
  bool same_before = false;  // it read so before, or so nearly that the two cannot be told apart
  bool confirmed = false;    // the device answered that it took the operation, and nothing else can pass for that
};

// The outcome of an operation after which the device reads as it should:
// - it read differently before: SUCCEEDED, verified;
// - it read the same before, and the device confirmed the operation: SUCCEEDED, not verified;
// - it read the same before, and nothing confirms the operation: INDETERMINATE.
[[nodiscard]] Outcome JudgeReadBack(const ReadBack& read_back, std::string text);

// A value within `tolerance` of `wanted` counts as read back. Returns whether `before` is so near to `wanted` that a
// value within the tolerance may be the old one: up to twice the tolerance.
[[nodiscard]] bool CannotBeToldApart(std::int64_t before, std::int64_t wanted, std::int64_t tolerance,
                                     std::int64_t range);

// The change `finding` of an operation that looks after another (OperationSpec::verified_by_operation). The device alone can only
// report that it reads as it should; whether that is an effect depends on what it read before.
inline constexpr const char* kReadsAsAfter = "reads_as_after";
inline constexpr const char* kNoEffectSeen = "no_effect_seen";
inline constexpr const char* kCannotTell = "cannot_tell";
[[nodiscard]] inline const char* FindingWord(bool reads_as_after) {
  return reads_as_after ? kReadsAsAfter : kNoEffectSeen;
}
[[nodiscard]] Change FindingChange(const char* word);

// Adds the same change with what such a look would have found before the operation, where the outcome leaves the effect
// open (kRunning or INDETERMINATE). The bridge compares it with what a look finds afterwards.
[[nodiscard]] Outcome WithFindingBefore(Outcome outcome, bool reads_as_after);

// The largest difference in counts, rounded up, between two readings of one place by an encoder whose maker gives an
// accuracy of +- `arc_seconds`: one may be off by that much to one side, the other to the other side. At least 1.
[[nodiscard]] std::int64_t NoiseOfAccuracy(int arc_seconds, int single_turn_bits);

}  // namespace axlecast
