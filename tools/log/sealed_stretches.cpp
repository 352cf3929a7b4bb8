#include "tools/log/sealed_stretches.h"

#include <algorithm>
#include <optional>

#include "tools/log/log_reader.h"

namespace axlecast {
namespace {

// A greater number is damage: sums of numbers do not overflow.
constexpr std::int64_t kGreatestNumber = INT64_MAX / 2;

// Records that a seal verifies: [begin, end). The record of the seal begins at `end`.
struct FoundStretch {
  LogSeal seal;
  std::size_t begin = 0;
  std::size_t end = 0;
  std::int64_t first = 0;  // number of the first record
  std::int64_t last = 0;
};

// Reads the numbers of the records in [begin, end). Returns false if they do not increase.
bool ReadNumbers(Bytes log, FoundStretch& found) {
  std::optional<std::int64_t> before;
  for (std::size_t offset = found.begin; offset < found.end;) {
    const std::optional<LogEvent> event = ParseEvent(log.first(found.end).subspan(offset));
    if (!event || event->number < 0 || event->number > kGreatestNumber) return false;
    if (before && event->number <= *before) return false;
    if (!before) found.first = event->number;
    found.last = event->number;
    before = event->number;
    offset += EventSize(*event);
  }
  return before.has_value();
}

// Returns the seal in front of the event `number` at `offset`.
std::optional<LogEvent> SealBefore(Bytes log, std::size_t offset, std::int64_t number) {
  if (offset < kSealRecord || offset > log.size()) return std::nullopt;
  std::optional<LogEvent> seal = ParseEvent(log.subspan(offset - kSealRecord, kSealRecord));
  if (!seal || seal->channel != kSealChannel || seal->number != number - 1) return std::nullopt;
  return seal;
}

LogReader ReaderFrom(Bytes log, const LogPlace& place) {
  const std::optional<LogEvent> seal = SealBefore(log, place.offset, place.number);
  return {log, place.offset, place.number - 1, seal ? std::optional(seal->utime) : std::nullopt};
}

// Searches the log from one place on for records that a seal verifies.
class SealSearch {
 public:
  SealSearch(Bytes log, const LogPlace& place) : log_(log), place_(place), floor_(place.offset) {}

  // Returns the first records with a seal that verifies them and that contain `place`, or a later event.
  [[nodiscard]] std::optional<FoundStretch> Run() {
    LogReader reader = ReaderFrom(log_, place_);
    for (auto event = reader.Next(); event; event = reader.Next()) {
      if (event->channel != kSealChannel) {
        count_.Add(log_.subspan(reader.offset(), EventSize(*event)));
        continue;
      }
      const std::optional<LogSeal> seal = ParseSeal(event->data);
      if (seal && seal->events > 0) {
        std::optional<FoundStretch> found = Verify(*seal, reader.offset());
        if (found && found->last >= place_.number) return found;
      }
      last_seal_ = event->number;
      ++seals_;
      floor_ = reader.position();
    }
    return std::nullopt;
  }

  // Seals that verify nothing; the number of the last one, and the offset behind it.
  [[nodiscard]] std::int64_t seals() const { return seals_; }
  [[nodiscard]] std::int64_t last_seal() const { return last_seal_; }
  [[nodiscard]] std::size_t behind_last_seal() const { return floor_; }

 private:
  [[nodiscard]] std::optional<FoundStretch> Verify(const LogSeal& seal, std::size_t end) const {
    FoundStretch found{.seal = seal, .begin = place_.offset, .end = end};
    // A sender may have published on the channel of the seals. Such a message is inside the stretch, and no seal counts it.
    if (count_.seal() == seal) {
      if (ReadNumbers(log_, found)) return found;
      return std::nullopt;
    }
    if (seal.bytes > end) return std::nullopt;
    found.begin = end - static_cast<std::size_t>(seal.bytes);
    // The place may be inside the stretch if a part was shipped without its seal. After damage, records may be verified from a
    // later offset on.
    const bool inside = seals_ == 0 && found.begin < place_.offset;
    if (found.begin < floor_ && !inside) return std::nullopt;
    if (Crc32c(0, log_.subspan(found.begin, end - found.begin)) != seal.crc32c) return std::nullopt;
    if (!ReadNumbers(log_, found)) return std::nullopt;
    return found;
  }

  Bytes log_;
  LogPlace place_;
  SealCount count_;
  std::int64_t last_seal_ = 0;
  std::int64_t seals_ = 0;
  std::size_t floor_;
};

// Returns the offset of the first record in [begin, end) that is not before `number`, else `end`.
std::size_t FindNumber(Bytes log, std::size_t begin, std::size_t end, std::int64_t number) {
  while (begin < end) {
    const std::optional<LogEvent> event = ParseEvent(log.subspan(begin));
    if (!event || event->number >= number) return begin;
    begin += EventSize(*event);
  }
  return end;
}

LogStretch Skip(const LogPlace& place, const LogPlace& next, std::int64_t messages) {
  return {.kind = LogStretch::Kind::kDamaged,
          .records = {},
          .next = next,
          .seal = {},
          .bytes = next.offset - place.offset,
          .messages = messages};
}

LogStretch Sealed(Bytes log, const LogPlace& place, const FoundStretch& found, std::int64_t seals) {
  // The first record of the stretch that was not returned before.
  const std::size_t begin = FindNumber(log, std::max(place.offset, found.begin), found.end, place.number);
  const std::int64_t first = std::max(place.number, found.first);
  if (first > place.number || begin > place.offset) {
    return Skip(place, {first, begin}, std::max<std::int64_t>(0, first - place.number - seals));
  }
  return {.kind = LogStretch::Kind::kSealed,
          .records = log.subspan(begin, found.end - begin),
          .next = {found.last + 2, found.end + kSealRecord},
          .seal = found.seal};
}

// The records at the end of a closed log, which no seal follows.
LogStretch Unsealed(Bytes log, const LogPlace& place) {
  LogReader reader = ReaderFrom(log, place);
  std::size_t end = place.offset;
  std::int64_t number = place.number;
  for (auto event = reader.Next(); event; event = reader.Next()) {
    const bool follows = reader.offset() == end && event->number == number;
    if (!follows && end > place.offset) break;
    if (!follows) {
      if (event->number < number || event->number > kGreatestNumber) continue;
      return Skip(place, {event->number, reader.offset()}, event->number - number);
    }
    if (end > place.offset && reader.position() - place.offset > kUnsealedBytes) break;
    end = reader.position();
    ++number;
  }
  if (end == place.offset) return Skip(place, {place.number + 1, log.size()}, -1);
  return {.kind = LogStretch::Kind::kUnsealed,
          .records = log.subspan(place.offset, end - place.offset),
          .next = {number, end}};
}

// Returns true if `number` is possible for the event behind the bytes from `place` to `offset`.
bool IsPossible(const LogPlace& place, std::int64_t number, std::size_t offset) {
  return number > place.number && number <= kGreatestNumber &&
         static_cast<std::uint64_t>(number - place.number) <= (offset - place.offset) / kSmallestEvent + 1;
}

}  // namespace

LogStretch NextStretch(Bytes log, const LogPlace& place, bool closed) {
  const LogStretch incomplete{.next = place};
  if (place.offset >= log.size() || place.number > kGreatestNumber) return incomplete;
  SealSearch search(log, place);
  if (const std::optional<FoundStretch> found = search.Run()) return Sealed(log, place, *found, search.seals());
  if (!closed) return incomplete;
  if (search.seals() == 0) return Unsealed(log, place);
  const std::int64_t number = search.last_seal();
  const std::size_t behind = search.behind_last_seal();
  if (number < kGreatestNumber && IsPossible(place, number + 1, behind)) {
    return Skip(place, {number + 1, behind}, std::max<std::int64_t>(0, number + 1 - place.number - search.seals()));
  }
  return Skip(place, {place.number + 1, log.size()}, -1);
}

LogPlace FindPlace(Bytes log, std::int64_t number, std::size_t hint) {
  if (number <= 0) return {};
  if (SealBefore(log, hint, number)) return {number, hint};
  if (hint < log.size()) {
    const std::optional<LogEvent> event = ParseEvent(log.subspan(hint));
    if (event && event->number == number) return {number, hint};
  }
  LogPlace place;
  while (place.number < number) {
    const LogStretch stretch = NextStretch(log, place, true);
    if (stretch.kind == LogStretch::Kind::kIncomplete) return {number, log.size()};
    if (stretch.next.number > number) {
      const std::size_t end = place.offset + stretch.records.size();
      return {number, FindNumber(log, place.offset, end, number)};
    }
    place = stretch.next;
  }
  return place;
}

}  // namespace axlecast
