#include "tools/log/log_reader.h"

#include <string.h>

#include <algorithm>
#include <array>

namespace axlecast {
namespace {

constexpr std::array<std::uint8_t, 4> kSync = {kEventSync >> 24U, kEventSync >> 16U & 0xFFU,
                                               kEventSync >> 8U & 0xFFU, kEventSync & 0xFFU};

// A sequence of this many records is accepted even if their numbers confirm nothing. A shorter one may be a log inside a message.
constexpr std::size_t kConvincingChain = 16;

// The range in which the time of an event may differ from that of its predecessor. Recorders' clocks are slewed.
constexpr std::int64_t kBackUs = 1'000'000;
constexpr std::int64_t kAheadUs = 60'000'000;

// The budget of links: enough for one event of the greatest length, and for each further event.
constexpr std::size_t kFirstLinks = kLargestLogData / kSmallestEvent;
constexpr std::size_t kLinksPerEvent = 4;

// Returns true if an event with `number` is possible at `offset` after the event `before`, which ended at `end`: there must be
// room for the events between them. Damage can produce any number.
bool Fits(std::int64_t before, std::size_t end, std::int64_t number, std::size_t offset) {
  if (number <= before || offset < end) return false;
  const std::uint64_t missing = static_cast<std::uint64_t>(number) - static_cast<std::uint64_t>(before) - 1;
  return missing <= (offset - end) / kSmallestEvent;
}

// Returns true if `number` is `before` + `steps`.
bool Follows(std::int64_t before, std::int64_t number, std::size_t steps = 1) {
  return static_cast<std::uint64_t>(number) - static_cast<std::uint64_t>(before) == steps;
}

bool IsNear(std::int64_t before, std::int64_t utime) {
  const std::uint64_t since = static_cast<std::uint64_t>(utime) - static_cast<std::uint64_t>(before);
  return since + kBackUs <= kBackUs + kAheadUs;
}

bool IsNotBefore(std::int64_t before, std::int64_t utime) { return utime >= before || IsNear(before, utime); }

// Reads from `begin` to the end. Returns true if that is enough: a seal was found, or `begin` is the start of the log.
bool ReadTail(Bytes log, std::size_t begin, LogTail& tail) {
  bool sealed = begin == 0;
  LogReader reader(log, begin);
  for (auto event = reader.Next(); event; event = reader.Next()) {
    tail.size = reader.position();
    tail.next_number = event->number < 0 || event->number == INT64_MAX ? 0 : event->number + 1;
    if (event->channel == kSealChannel) {
      tail.open.Reset();
      sealed = true;
    } else {
      tail.open.Add(log.subspan(reader.offset(), EventSize(*event)));
    }
  }
  tail.torn = log.size() - tail.size;
  return sealed;
}

}  // namespace

LogReader::LogReader(Bytes log, std::size_t begin)
    : log_(log), offset_(std::min(begin, log.size())), position_(offset_), links_(kFirstLinks) {
  if (begin == 0) anchor_ = Anchor{-1, 0};  // before the first event
}

LogReader::LogReader(Bytes log, std::size_t begin, std::int64_t before, std::optional<std::int64_t> utime)
    : LogReader(log, begin) {
  anchor_ = Anchor{before, position_};
  utime_ = utime;
}

std::optional<LogEvent> LogReader::Next() {
  std::size_t offset = position_;
  std::optional<LogEvent> event = At(offset);
  if (!event || BelongsToData(*event)) {
    offset = FindNextRecord(position_);
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

// Returns the offset of the first sync word that begins in [begin, end), else `end`.
std::size_t LogReader::FindSync(std::size_t begin, std::size_t end) const {
  if (begin >= end) return end;
  const std::size_t size = std::min(end - begin + kSync.size() - 1, log_.size() - begin);
  const void* const found = memmem(log_.data() + begin, size, kSync.data(), kSync.size());
  return found == nullptr ? end : static_cast<std::size_t>(static_cast<const std::uint8_t*>(found) - log_.data());
}

// Returns true if number and time of the event are plausible after the events that were read.
bool LogReader::IsPlausible(const LogEvent& event, std::size_t offset) const {
  if (!anchor_) return false;
  if (Fits(anchor_->number, anchor_->end, event.number, offset)) return true;
  return event.number > anchor_->number && utime_ && IsNear(*utime_, event.utime);
}

// Returns true if one of the next records from `offset` on has the number after `number`.
bool LogReader::LeadsBehind(std::int64_t number, std::size_t offset) const {
  for (std::size_t i = 0; i < kConvincingChain; ++i) {
    const std::optional<LogEvent> link = At(offset);
    if (!link) return false;
    if (Follows(number, link->number)) return true;
    offset += EventSize(*link);
  }
  return false;
}

// Returns true if the record after the last event does not belong to the log, because the record with the next number follows
// later. This happens if a damaged length ends before a record inside the data of its event.
bool LogReader::BelongsToData(const LogEvent& event) const {
  if (!anchor_ || anchor_->end != position_ || IsPlausible(event, position_) || event.utime >= utime_) return false;
  return LeadsBehind(anchor_->number, position_);
}

// Returns true if a record that was found after damage belongs to the log, and is not inside the data of another record.
bool LogReader::BelongsToLog(const LogEvent& event, std::size_t offset) const {
  if (anchor_ && !utime_) return true;  // the first event of the log has no predecessor
  LogEvent link = event;
  for (std::size_t i = 0; i < kConvincingChain; ++i) {
    // This record belongs to the log. So do those before it, if their numbers lead to it.
    if (IsPlausible(link, offset)) return Follows(event.number, link.number, i);
    offset += EventSize(link);
    if (offset == log_.size()) return !utime_ || (i > 0 && IsNotBefore(*utime_, event.utime));
    const std::optional<LogEvent> next = At(offset);
    if (!next) return false;
    link = *next;
  }
  return true;
}

// Returns the offset of the next record from `begin` on that belongs to the log, else the size of the log.
std::size_t LogReader::FindNextRecord(std::size_t begin) const {
  for (std::size_t offset = FindSync(begin, log_.size()); offset < log_.size();
       offset = FindSync(offset + 1, log_.size())) {
    const std::optional<LogEvent> event = At(offset);
    if (event && BelongsToLog(*event, offset)) return offset;
  }
  return log_.size();
}

// Follows the chain that begins with the event, up to the first record that begins at `limit` or later.
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

// Returns the offset of a record of the log that lies inside the event: then the length of the event is damaged. If the event is
// followed by the next number, there is no such record.
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

// Returns true if the record `inner`, which lies inside the event and is part of `chain`, belongs to the log. The data of an
// undamaged event may contain records too, even a complete log. But those were written before the event, their chain does not
// continue after the event, and if it ends with the event, their numbers are not between those of the event and the next one.
bool LogReader::Disproves(const LogEvent& event, std::size_t offset, const LogEvent& inner,
                          std::size_t inner_offset, const Chain& chain) const {
  const std::size_t end = offset + EventSize(event);
  const bool later = inner.utime >= event.utime;
  const bool in_time = IsNotBefore(event.utime, inner.utime) || (utime_ && IsNotBefore(*utime_, inner.utime));
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
  std::size_t low = 0;            // all events before it are before `early`
  std::size_t high = log.size();  // the events after it, and possibly a few before it, are not
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

LogTail FindTail(Bytes log, std::size_t look) {
  LogTail tail;
  if (log.size() > look && ReadTail(log, log.size() - look, tail)) return tail;
  tail = {};
  static_cast<void>(ReadTail(log, 0, tail));
  return tail;
}

}  // namespace axlecast
