#include "tools/monitor/command_history.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace axlecast {
namespace {

bool SameId(const command_status_t& one, const command_status_t& other) {
  return std::equal(std::begin(one.id), std::end(one.id), std::begin(other.id));
}

}  // namespace

bool CommandHistory::On(command_status_t status) {
  const auto state = static_cast<std::uint8_t>(status.state);
  if (state == command_status_t::STATE_UNKNOWN || state >= kStates) return false;
  const bool is_final = status.is_final != 0;
  const auto known = std::find_if(newest_.rbegin(), newest_.rend(),
                                  [&status](const command_status_t& other) { return SameId(other, status); });
  if (known == newest_.rend()) {
    if (newest_.size() == kMax) newest_.pop_front();
    newest_.push_back(std::move(status));
    last_ = newest_.size() - 1;
    if (is_final) ++outcomes_[state];
    return true;
  }
  // An outcome never changes; only a finding may follow it.
  const bool was_final = known->is_final != 0;
  const bool same = known->state == status.state && known->finding == status.finding &&
                    known->progress == status.progress && known->text == status.text;
  if (same || (was_final && known->state != status.state)) return false;
  *known = std::move(status);
  last_ = static_cast<std::size_t>(std::distance(known, newest_.rend())) - 1;
  if (is_final && !was_final) ++outcomes_[state];
  return true;
}

}  // namespace axlecast
