#include "drivers/saa_serial/stream_parser.h"

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
  lost.position = position_ - 1;
  lost.first = inbox_.ArrivalOf(at_ - 1);
  lost.last = lost.first;
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

}  // namespace axlecast::saa_serial
