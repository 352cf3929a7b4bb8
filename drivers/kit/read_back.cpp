#include "drivers/kit/read_back.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <utility>

#include "core/device/operation.h"

namespace axlecast {

Outcome JudgeReadBack(const ReadBack& read_back, std::string text) {
  if (!read_back.same_before) return Verified(std::move(text));
  if (read_back.confirmed) {
    return Succeeded(false, std::move(text) + ": as before; the device confirmed it, no effect can be seen");
  }
  return Final(CommandState::kIndeterminate, command_status_t::REASON_NO_REPLY,
               std::move(text) + ": as before, and nothing confirms that it was taken");
}

bool CannotBeToldApart(std::int64_t before, std::int64_t wanted, std::int64_t tolerance, std::int64_t range) {
  return CircularDistance(before, wanted, range) <= 2 * tolerance;
}

Change FindingChange(const char* word) { return {"finding", "", word}; }

Outcome WithFindingBefore(Outcome outcome, bool reads_as_after) {
  const bool open = outcome.state == CommandState::kRunning || outcome.state == CommandState::kIndeterminate;
  if (open) outcome.changes.push_back({"finding", FindingWord(reads_as_after), ""});
  return outcome;
}

std::int64_t NoiseOfAccuracy(int arc_seconds, int single_turn_bits) {
  constexpr std::int64_t kPerTurn = 360 * 3'600;
  const std::int64_t scaled = 2 * std::int64_t{arc_seconds} << static_cast<unsigned>(single_turn_bits);
  return std::max<std::int64_t>(1, (scaled + kPerTurn - 1) / kPerTurn);
}

}  // namespace axlecast
