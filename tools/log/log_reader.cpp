#include "tools/log/log_reader.h"

#include <algorithm>
#include <array>
#include <cstring>

namespace axlecast {
namespace {

constexpr std::array<std::uint8_t, 4> kSync = {kEventSync >> 24U, kEventSync >> 16U & 0xFFU,
                                               kEventSync >> 8U & 0xFFU, kEventSync & 0xFFU};

// Records in a row whose numbers tell nothing are believed from here on: fewer may be a log in a message's data.
constexpr int kConvincingChain = 8;

// An event that is a little later than the one before it, although recorders' clocks are slewed.
constexpr std::int64_t kBackUs = 1'000'000;
constexpr std::int64_t kAheadUs = 60'000'000;

// Links for one length that reaches over as much as a length can, and for each further event.
constexpr std::size_t kFirstLinks = kLargestLogData / kSmallestEvent;
constexpr std::size_t kLinksPerEvent = 4;

// Whether an event with `number` may stand at `offset` when the one with `before` ended at `end`, or later: there is
// room for all that are missing between them. Numbers may be any that damage can make of them.
bool Fits(std::int64_t before, std::size_t end, std::int64_t number, std::size_t offset) {
  if (number <= before || offset < end) return false;
  const std::uint64_t missing = static_cast<std::uint64_t>(number) - static_cast<std::uint64_t>(before) - 1;
  return missing <= (offset - end) / kSmallestEvent;
}

bool Near(std::int64_t before, std::int64_t utime) {
  const std::uint64_t since = static_cast<std::uint64_t>(utime) - static_cast<std::uint64_t>(before);
  return since + kBackUs <= kBackUs + kAheadUs;
}

}  // namespace

LogReader::LogReader(Bytes log, std::size_t begin)
    : log_(log), offset_(std::min(begin, log.size())), position_(offset_), links_(kFirstLinks) {
  if (begin == 0) anchor_.emplace();
}

std::optional<LogEvent> LogReader::Next() {
  std::size_t offset = position_;
  std::optional<LogEvent> event = At(offset);
  if (!event) {
    offset = Resume(position_);
    event = At(offset);
  }
  while (event) {
    const std::optional<std::size_t> swallowed = FindSwallowed(*event, offset);
    if (!swallowed) break;
    offset = *swallowed;
    event = At(offset);
  }
  const bool at_begin = !utime_ && !anchor_;
  if (offset > position_ && !at_begin) damage_.push_back({position_, offset - position_});
  offset_ = offset;
  position_ = event ? offset + EventSize(*event) : log_.size();
  if (event) Take(*event, offset);
  return event;
}

std::optional<LogEvent> LogReader::At(std::size_t offset) const { return ParseEvent(log_.subspan(offset)); }

// The first sync word that begins in [begin, end); else `end`.
std::size_t LogReader::FindSync(std::size_t begin, std::size_t end) const {
  if (begin >= end) return end;
  const std::size_t size = std::min(end - begin + kSync.size() - 1, log_.size() - begin);
  const void* const found = memmem(log_.data() + begin, size, kSync.data(), kSync.size());
  return found == nullptr ? end : static_cast<std::size_t>(static_cast<const std::uint8_t*>(found) - log_.data());
}

// Whether number and time are such as follow on what was read.
bool LogReader::Plausible(const LogEvent& event, std::size_t offset) const {
  if (!anchor_) return false;
  if (Fits(anchor_->number, anchor_->end, event.number, offset)) return true;
  return event.number > anchor_->number && utime_ && Near(*utime_, event.utime);
}

// Whether a record that was found after damage is the log's, and not one in another record's data.
bool LogReader::Believed(const LogEvent& event, std::size_t offset) const {
  if (anchor_ && !utime_) return true;  // the log's first: there is nothing that it has to follow on
  LogEvent link = event;
  for (int i = 0; i < kConvincingChain; ++i) {
    if (Plausible(link, offset)) return true;
    offset += EventSize(link);
    if (offset == log_.size()) return i > 0 || !utime_;
    const std::optional<LogEvent> next = At(offset);
    if (!next) return false;
    link = *next;
  }
  return true;
}

// The next believed record behind `begin`; else the log's size.
std::size_t LogReader::Resume(std::size_t begin) const {
  for (std::size_t offset = FindSync(begin, log_.size()); offset < log_.size();
       offset = FindSync(offset + 1, log_.size())) {
    const std::optional<LogEvent> event = At(offset);
    if (event && Believed(*event, offset)) return offset;
  }
  return log_.size();
}

// Follows the chain that begins with the event until a record that begins at `limit` or behind.
LogReader::Chain LogReader::Follow(const LogEvent& event, std::size_t offset, std::size_t limit) {
  std::optional<LogEvent> link = event;
  while (true) {
    const std::size_t next = offset + EventSize(*link);
    if (next == log_.size()) return {offset, true};
    link = At(next);
    if (!link || links_ == 0 || offset >= limit) return {offset, false};
    --links_;
    offset = next;
  }
}

// The offset of a record that the event's length reaches over although it is the log's own, which shows that the length
// is damaged. Not looked for where the next number follows.
std::optional<std::size_t> LogReader::FindSwallowed(const LogEvent& event, std::size_t offset) {
  const std::size_t end = offset + EventSize(event);
  if (const auto next = At(end); next && event.number < next->number && next->number - 1 == event.number) {
    return std::nullopt;
  }
  std::size_t candidate = FindSync(offset + kSmallestEvent, end);
  while (candidate < end) {
    std::size_t behind = candidate;
    if (const auto inner = At(candidate)) {
      if (Disproves(event, offset, *inner, candidate)) return candidate;
      behind = Follow(*inner, candidate, end).last;
    }
    candidate = FindSync(behind + 1, end);
  }
  return std::nullopt;
}

// Whether a record within the event's is the log's own. In the data of an undamaged event may stand records too, a whole
// log even: but none that goes on behind the event, nor, where it ends with it, with numbers from between the event's
// and the next one's.
bool LogReader::Disproves(const LogEvent& event, std::size_t offset, const LogEvent& inner,
                          std::size_t inner_offset) {
  const std::size_t end = offset + EventSize(event);
  const Chain chain = Follow(inner, inner_offset, end);
  const bool follows =
      Fits(event.number, offset + kSmallestEvent, inner.number, inner_offset) ||
      (anchor_ && anchor_->end == offset && Fits(anchor_->number, anchor_->end, inner.number, inner_offset));
  if (end == log_.size()) return chain.to_end && follows;
  const std::optional<LogEvent> next = At(end);
  if (!next) return chain.last >= end || chain.to_end || follows;
  const bool ordered = event.number < next->number;
  if (!ordered && !anchor_) return false;
  const std::int64_t before = ordered ? event.number : anchor_->number;
  return chain.last >= end && before < inner.number && inner.number < next->number;
}

void LogReader::Take(const LogEvent& event, std::size_t offset) {
  const std::optional<LogEvent> next = At(position_);
  const bool confirmed = next && event.number < next->number && next->number - 1 == event.number;
  if (confirmed || (anchor_ && Fits(anchor_->number, anchor_->end, event.number, offset))) {
    anchor_ = {event.number, position_};
  }
  utime_ = event.utime;
  links_ += kLinksPerEvent;
}

std::size_t SeekTime(Bytes log, std::int64_t utime) {
  const std::int64_t early = std::max(utime, INT64_MIN + kSeekSlackUs) - kSeekSlackUs;
  std::size_t low = 0;            // what stands before it is before `early`
  std::size_t high = log.size();  // what stands behind it, and a few events before it, is not
  while (low < high) {
    const std::size_t middle = low + (high - low) / 2;
    LogReader reader(log.first(high), middle);
    const std::optional<LogEvent> event = reader.Next();
    if (event && event->utime < early) {
      low = reader.position();
    } else {
      high = middle;
    }
  }
  LogReader reader(log, low);
  for (auto event = reader.Next(); event; event = reader.Next()) {
    if (event->utime >= utime) return reader.offset();
  }
  return log.size();
}

}  // namespace axlecast
