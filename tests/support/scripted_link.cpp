#include "tests/support/scripted_link.h"

#include <algorithm>
#include <utility>

namespace axlecast {

void ScriptedLink::RefuseOpens(int times, std::string problem) {
  refusals_ = times;
  refusal_ = std::move(problem);
}

Result<> ScriptedLink::Open() {
  open_times_.push_back(clock_.Now());
  if (refusals_ > 0) {
    --refusals_;
    return Failure(refusal_);
  }
  if (lost_at_ <= clock_.Now()) lost_at_ = kNever;
  arrivals_.clear();
  open_ = true;
  return {};
}

bool ScriptedLink::Write(Bytes bytes) {
  clock_.Advance(write_time_);
  if (Gone()) return false;
  written_.emplace_back(bytes.begin(), bytes.end());
  write_times_.push_back(clock_.Now());
  if (!peer_) return true;
  for (Burst& burst : peer_(bytes)) ArriveAt(clock_.Now() + burst.after, std::move(burst.bytes));
  return true;
}

ByteLink::ReadResult ScriptedLink::Read(std::span<std::uint8_t> into, MonoNs deadline) {
  if (Gone()) return {.status = Status::kLost, .count = 0};
  const MonoNs next = std::min({NextArrival(), lost_at_, deadline});
  clock_.MoveTo(std::max(clock_.Now(), next));
  return ReadNow(into);
}

ByteLink::ReadResult ScriptedLink::ReadNow(std::span<std::uint8_t> into) {
  ++reads_now_;
  if (Gone()) return {.status = Status::kLost, .count = 0};
  std::size_t count = 0;
  while (count < into.size() && NextArrival() <= clock_.Now()) {
    std::vector<std::uint8_t>& bytes = arrivals_.begin()->second;
    const std::size_t taken = std::min(bytes.size(), into.size() - count);
    std::copy_n(bytes.begin(), taken, into.begin() + static_cast<std::ptrdiff_t>(count));
    count += taken;
    if (taken == bytes.size()) {
      arrivals_.erase(arrivals_.begin());
    } else {
      bytes.erase(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(taken));
    }
  }
  return {.status = count > 0 ? Status::kOk : Status::kTimeout, .count = count};
}

ByteLink::Status ScriptedLink::Wait(MonoNs until) {
  ++waits_;
  if (woken_.exchange(false)) return Status::kWoken;
  const MonoNs wake = wakes_.empty() ? kNever : *wakes_.begin();
  const MonoNs next = std::min({until, wake, open_ ? std::min(NextArrival(), lost_at_) : kNever});
  clock_.MoveTo(std::max(clock_.Now(), next));
  if (open_ && Gone()) return Status::kLost;
  if (wake <= clock_.Now()) {
    wakes_.erase(wakes_.begin());
    return Status::kWoken;
  }
  return open_ && NextArrival() <= clock_.Now() ? Status::kOk : Status::kTimeout;
}

}  // namespace axlecast
