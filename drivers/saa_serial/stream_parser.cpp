#include "drivers/saa_serial/stream_parser.h"

#include <algorithm>

#include "core/device/operation.h"

namespace axlecast::saa_serial {

void StreamParser::Append(Bytes bytes, Interval received) {
  inbox_.Append(bytes, received);
  newest_ = end_;
  end_ += static_cast<std::int64_t>(bytes.size());
}

void StreamParser::Restart() {
  inbox_.Clear();
  at_ = 0;
  position_ = end_;
  expected_.reset();
  run_ = 0;
}

std::optional<StreamParser::Found> StreamParser::Next() {
  std::optional<Found> found;
  while (!found) {
    const Bytes rest = inbox_.bytes().subspan(at_);
    if (rest.size() < size_) break;
    const Verdict verdict = Evaluate(rest);
    if (verdict == Verdict::kWait) break;
    found = verdict == Verdict::kTake ? Take(counts_) : Skip(rest);
  }
  if (found) return found;
  inbox_.Drop(at_);
  at_ = 0;
  return std::nullopt;
}

StreamParser::Is StreamParser::Candidate(Bytes rest, std::size_t at, std::uint32_t* counts) const {
  if (at < rest.size() && rest[at] != kFrameStart) return Is::kNo;
  if (at + 1 < rest.size() && rest[at + 1] != kFixedHeader) return Is::kNo;
  if (at + size_ > rest.size()) return Is::kOpen;
  const Reply reply = ParseReply(rest.subspan(at, size_), format_);
  if (counts != nullptr) *counts = reply.counts;
  return reply.error == ReplyError::kNone ? Is::kYes : Is::kNo;
}

bool StreamParser::Recent() const {
  return expected_ && position_ - *expected_ <= kRecent * static_cast<std::int64_t>(size_);
}

bool StreamParser::InStep(std::size_t at) const {
  const auto begin = position_ + static_cast<std::int64_t>(at);
  return expected_ && (begin - *expected_) % static_cast<std::int64_t>(size_) == 0;
}

std::int64_t StreamParser::FromLast(std::uint32_t counts) const {
  return CircularDistance(counts, last_, std::int64_t{1} << format_.bits);
}

StreamParser::Verdict StreamParser::Evaluate(Bytes rest) {
  if (Candidate(rest, 0, &counts_) != Is::kYes) return Verdict::kSkip;
  // A joined frame with the checksum FF does not wait for the byte behind it: Take leaves it to the next frame.
  const std::size_t end = Joined() ? size_ - 1 : size_;
  bool rivals = false;
  for (std::size_t at = 1; at < end; ++at) {
    const Is is = Candidate(rest, at);
    if (is == Is::kOpen) return Verdict::kWait;
    rivals = rivals || is == Is::kYes;
  }
  return rivals ? EvaluateRivals(rest) : Verdict::kTake;
}

StreamParser::Verdict StreamParser::EvaluateRivals(Bytes rest) {
  const Is own = Candidate(rest, size_);
  if (own == Is::kOpen) return Verdict::kWait;
  if (own == Is::kYes && Joined()) return Verdict::kTake;
  bool differs = false;
  bool better = false;  // a rival is
  bool nearer = false;
  for (std::size_t at = 1; at < size_; ++at) {
    std::uint32_t rival = 0;
    const Is is = Candidate(rest, at, &rival);
    if (is == Is::kNo) continue;
    const Is next = Candidate(rest, at + size_);
    if (is == Is::kOpen || next == Is::kOpen) return Verdict::kWait;
    better = better || (own == Is::kNo && (next == Is::kYes || InStep(at)));
    if (own != next || rival == counts_) continue;
    differs = true;
    nearer = nearer || FromLast(rival) <= FromLast(counts_);
  }
  if (better) return Verdict::kSkip;
  if (!differs || (own == Is::kNo && InStep(0))) return Verdict::kTake;
  if (Recent()) return nearer ? Verdict::kSkip : Verdict::kTake;
  if (own == Is::kYes) ++ambiguous_;
  return Verdict::kSkip;
}

std::optional<StreamParser::Found> StreamParser::Skip(Bytes rest) {
  const bool shared = Shared();
  const Reply reply = ParseReply(rest.first(size_), format_);
  const auto size = static_cast<std::int64_t>(size_);
  ++at_;
  ++position_;
  if (shared) return std::nullopt;
  ++skipped_;
  ++run_;
  // Who begins to listen amid a frame has lost nothing.
  const std::int64_t first = expected_ ? 1 : size;
  if (run_ != first && (run_ % size != 0 || run_ < 2 * size)) return std::nullopt;
  Found lost;
  lost.error = reply.error == ReplyError::kRange ? ErrorKind::kRange : ErrorKind::kChecksum;
  lost.first = inbox_.ArrivalOf(at_ - 1);
  return lost;
}

StreamParser::Found StreamParser::Take(std::uint32_t counts) {
  Found found;
  found.counts = counts;
  found.position = position_;
  found.first = inbox_.ArrivalOf(at_);
  found.last = inbox_.ArrivalOf(at_ + size_ - 1);
  const std::int64_t end = position_ + static_cast<std::int64_t>(size_);
  if (end > newest_) found.behind = static_cast<std::size_t>(end_ - end);
  expected_ = end;
  // A checksum that is FF may be the first byte of the next frame instead.
  const std::size_t done = inbox_.bytes()[at_ + size_ - 1] == kFrameStart ? size_ - 1 : size_;
  at_ += done;
  position_ += static_cast<std::int64_t>(done);
  last_ = counts;
  run_ = 0;
  return found;
}

// ---- the instant of a frame ----

Interval StreamedInstant(const StreamParser::Found& found, std::size_t frame_size, const StreamTimes& times) {
  const auto characters = [](std::size_t count, MonoNs each) { return static_cast<MonoNs>(count) * each; };
  const std::size_t behind = found.behind.value_or(0);
  const MonoNs latest = std::min(found.first.last - times.character,
                                 found.last.last - characters(frame_size + behind, times.character));
  MonoNs earliest = found.first.first;
  if (found.behind) {
    // Had the first byte waited for longer, one more frame would have come with it.
    const auto frames = static_cast<MonoNs>(1 + behind / frame_size);
    earliest = std::max(earliest, found.last.last - frames * times.period - characters(frame_size, times.slowest));
  }
  earliest -= times.latency + times.processing + times.slowest;
  return {earliest, std::max(earliest, latest)};
}

void StalledFrames::Restart(MonoNs now) {
  arrived_ = now;
  until_ = 0;
  behind_.reset();
  earliest_.reset();
}

void StalledFrames::Arrived(MonoNs now) {
  const MonoNs pause = now - arrived_;
  if (pause > times_.period + times_.latency) until_ = now + times_.late;
  if (pause > times_.period + times_.period / 8) behind_.reset();
  arrived_ = now;
}

Interval StalledFrames::Widened(Interval at) {
  if (earliest_ && arrived_ < until_) at.first = Earliest(at.first);
  earliest_ = at.first;
  return at;
}

MonoNs StalledFrames::Earliest(MonoNs in_time) {
  // The encoder's clock may be this much faster than its nominal refresh rate.
  const MonoNs shortest_period = times_.period / 100 * 99;
  const MonoNs longest_stall = in_time - std::max<MonoNs>(0, times_.late - times_.latency);
  MonoNs earliest = std::max(*earliest_ + shortest_period, longest_stall);
  if (behind_) earliest = std::max(earliest, in_time - *behind_);
  if (earliest >= in_time) {  // nothing can be late any more
    until_ = 0;
    return in_time;
  }
  if (behind_ || in_time - earliest <= times_.period) behind_ = in_time - earliest;
  return earliest;
}

}  // namespace axlecast::saa_serial
