#include "tools/log/log_reader.h"

#include <algorithm>
#include <array>
#include <cstring>

namespace axlecast {
namespace {

constexpr std::array<std::uint8_t, 4> kSync = {kEventSync >> 24U, kEventSync >> 16U & 0xFFU,
                                               kEventSync >> 8U & 0xFFU, kEventSync & 0xFFU};

// Records in a row whose numbers tell nothing are believed from here on: fewer may be a log in a message's data.
constexpr std::size_t kConvincingChain = 16;

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

// Whether `number` is the one that comes `steps` behind `before`.
bool Follows(std::int64_t before, std::int64_t number, std::size_t steps = 1) {
  return static_cast<std::uint64_t>(number) - static_cast<std::uint64_t>(before) == steps;
}

bool Near(std::int64_t before, std::int64_t utime) {
  const std::uint64_t since = static_cast<std::uint64_t>(utime) - static_cast<std::uint64_t>(before);
  return since + kBackUs <= kBackUs + kAheadUs;
}

bool NotBefore(std::int64_t before, std::int64_t utime) { return utime >= before || Near(before, utime); }

}  // namespace

LogReader::LogReader(Bytes log, std::size_t begin)
    : log_(log), offset_(std::min(begin, log.size())), position_(offset_), links_(kFirstLinks) {
  if (begin == 0) anchor_ = Anchor{-1, 0};  // before the first
}

std::optional<LogEvent> LogReader::Next() {
  std::size_t offset = position_;
  std::optional<LogEvent> event = At(offset);
  if (!event || Foreign(*event)) {
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

// Whether the records from `offset` on lead to the number behind `number`.
bool LogReader::LeadsBehind(std::int64_t number, std::size_t offset) const {
  for (std::size_t i = 0; i < kConvincingChain; ++i) {
    const std::optional<LogEvent> link = At(offset);
    if (!link) return false;
    if (Follows(number, link->number)) return true;
    offset += EventSize(*link);
  }
  return false;
}

// Whether the record behind the last event is none of the log's: the one whose number follows comes after it. So it is
// where a length was damaged to end before a record in its event's data.
bool LogReader::Foreign(const LogEvent& event) const {
  if (!anchor_ || anchor_->end != position_ || Plausible(event, position_) || event.utime >= utime_) return false;
  return LeadsBehind(anchor_->number, position_);
}

// Whether a record that was found after damage is the log's, and not one in another record's data.
bool LogReader::Believed(const LogEvent& event, std::size_t offset) const {
  if (anchor_ && !utime_) return true;  // the log's first: there is nothing that it has to follow on
  LogEvent link = event;
  for (std::size_t i = 0; i < kConvincingChain; ++i) {
    // The log's own again: the ones before are so too where their numbers lead to it.
    if (Plausible(link, offset)) return Follows(event.number, link.number, i);
    offset += EventSize(link);
    if (offset == log_.size()) return !utime_ || (i > 0 && NotBefore(*utime_, event.utime));
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
  Chain chain{.last = offset};
  for (std::optional<LogEvent> link = event; link && chain.last < limit; --links_) {
    const std::size_t next = chain.last + EventSize(*link);
    chain.to_end = next == log_.size();
    link = At(next);
    if (!link || links_ == 0) break;
    chain.last = next;
    ++chain.links;
  }
  return chain;
}

// The offset of a record that the event's length reaches over although it is the log's own, which shows that the length
// is damaged. Not looked for where the next number follows.
std::optional<std::size_t> LogReader::FindSwallowed(const LogEvent& event, std::size_t offset) {
  const std::size_t end = offset + EventSize(event);
  if (LeadsBehind(event.number, end)) return std::nullopt;
  std::size_t candidate = FindSync(offset + kSmallestEvent, end);
  while (candidate < end) {
    std::optional<LogEvent> inner = At(candidate);
    std::size_t behind = candidate;
    if (inner) {
      Chain chain = Follow(*inner, candidate, end);
      while (inner && candidate < end) {
        if (Disproves(event, offset, *inner, candidate, chain)) return candidate;
        behind = candidate;
        candidate += EventSize(*inner);
        --chain.links;
        if (candidate <= chain.last)
          inner = At(candidate);
        else
          inner.reset();
      }
    }
    candidate = FindSync(behind + 1, end);
  }
  return std::nullopt;
}

// Whether a record within the event's, of this chain, is the log's own. In the data of an undamaged event may stand
// records too, a whole log even: but written before the event, none that goes on behind it, nor, where they end with it,
// with numbers from between the event's and the next one's.
bool LogReader::Disproves(const LogEvent& event, std::size_t offset, const LogEvent& inner,
                          std::size_t inner_offset, const Chain& chain) const {
  const std::size_t end = offset + EventSize(event);
  const bool later = inner.utime >= event.utime;
  const bool in_time = NotBefore(event.utime, inner.utime) || (utime_ && NotBefore(*utime_, inner.utime));
  const bool follows = in_time && (Fits(event.number, offset + kSmallestEvent, inner.number, inner_offset) ||
                                   (anchor_ && Fits(anchor_->number, anchor_->end, inner.number, inner_offset)));
  if (later && follows) return true;
  if (end == log_.size()) return chain.to_end && (follows || later);
  const std::optional<LogEvent> next = At(end);
  const bool behind = chain.last >= end || chain.to_end;
  if (!next) return follows || (later && behind);
  if (event.number < inner.number && inner.number < next->number) return behind && (later || follows);
  return behind && (follows || (in_time && chain.last == end && Follows(inner.number, next->number, chain.links)));
}

void LogReader::Take(const LogEvent& event, std::size_t offset) {
  const std::optional<LogEvent> next = At(position_);
  const bool confirmed = next && Follows(event.number, next->number);
  if (confirmed || (anchor_ && Fits(anchor_->number, anchor_->end, event.number, offset))) {
    anchor_ = Anchor{event.number, position_};
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
