#include "tools/fleet/read/log_digest.h"

#include <algorithm>
#include <axlecast/position_block_t.hpp>
#include <axlecast/position_t.hpp>

#include "core/messages/json/field.h"
#include "core/messages/message.h"
#include "tools/log/log_reader.h"
#include "tools/log/sealed_stretches.h"

namespace axlecast {
namespace {

constexpr std::int64_t kDigestMinute = 60'000'000;  // us
constexpr std::string_view kPositionStart = "POSITION/";
constexpr std::string_view kBlockStart = "POSITION_BLOCK/";

// The finalizer of SplitMix64 (Steele, Lea, Flood 2014).
std::uint64_t Mixed(std::uint64_t bits) {
  bits = (bits ^ (bits >> 30U)) * 0xBF58476D1CE4E5B9U;
  bits = (bits ^ (bits >> 27U)) * 0x94D049BB133111EBU;
  return bits ^ (bits >> 31U);
}

std::uint64_t HashOf(std::uint64_t seed, std::int64_t utime, std::int64_t counts, std::int32_t flags) {
  std::uint64_t hash = Mixed(seed + static_cast<std::uint64_t>(utime));
  hash = Mixed(hash + static_cast<std::uint64_t>(counts));
  return Mixed(hash + static_cast<std::uint32_t>(flags));
}

}  // namespace

void PositionDigest::Add(std::int64_t utime, std::int64_t counts, std::int32_t flags) {
  std::int64_t begin = utime - utime % kDigestMinute;
  if (begin > utime) begin -= kDigestMinute;
  Minute& minute = minutes_[begin];
  ++samples_;
  ++minute.n;
  minute.sums[0] += HashOf(0x9E3779B97F4A7C15U, utime, counts, flags);
  minute.sums[1] += HashOf(0xD1B54A32D192ED03U, utime, counts, flags);
}

std::vector<MinuteDifference> DifferencesOf(const PositionDigest& log, const PositionDigest& database) {
  std::vector<MinuteDifference> differences;
  for (const auto& [utime, minute] : log.minutes()) {
    const auto other = database.minutes().find(utime);
    if (other == database.minutes().end()) {
      differences.push_back({utime, minute.n, 0});
    } else if (!(minute == other->second)) {
      differences.push_back({utime, minute.n, other->second.n});
    }
  }
  for (const auto& [utime, minute] : database.minutes()) {
    if (!log.minutes().contains(utime)) differences.push_back({utime, 0, minute.n});
  }
  std::ranges::sort(differences, {}, &MinuteDifference::utime);
  return differences;
}

bool LogDigest::TakeOdd(const LogEvent& event) {
  for (; next_odd_ < odd_.size() && odd_[next_odd_].event < event.number; ++next_odd_) ++wrong_odd_;
  if (next_odd_ == odd_.size() || odd_[next_odd_].event != event.number) return false;
  if (odd_[next_odd_++].crc32c != Crc32c(0, event.data)) ++wrong_odd_;
  return true;
}

void LogDigest::Add(const LogEvent& event, std::size_t end) {
  if (event.number >= upto_) {
    ++remaining_;
    return;
  }
  next_ = event.number + 1;
  ++events_;
  bytes_ = end;
  if (event.channel == kSealChannel) chain_ = Crc32c(chain_, event.data);
  if (TakeOdd(event) || !event.channel.starts_with(prefix_)) return;
  const std::string_view channel = event.channel.substr(prefix_.size());
  const bool blocks = channel.starts_with(kBlockStart);
  if (!blocks && !channel.starts_with(kPositionStart)) return;
  const auto head = ReadHead(event.data);
  if (!head || !windows_[std::string(channel)].IsNew(head->boot_id, head->seq)) return;
  DevicePositions& device = devices_[std::string(channel.substr(channel.find('/') + 1))];
  if (!blocks) {
    const auto message = DecodeMessage<position_t>(event.data);
    if (message) device.positions.Add(message->utime, message->counts, message->flags);
  } else if (const auto message = DecodeMessage<position_block_t>(event.data)) {
    for (std::size_t i = 0; i < message->counts.size(); ++i) {
      device.blocks.Add(BlockSampleUtime(*message, i), message->counts[i], message->flags[i]);
    }
  }
}

void LogDigest::AddEvents(Bytes log, std::size_t begin, std::size_t end) {
  LogReader reader(log.first(end), begin);
  for (auto event = reader.Next(); event; event = reader.Next()) Add(*event, reader.position());
}

void LogDigest::AddLog(Bytes log, const std::vector<LogGap>& gaps) {
  LogPlace place;
  for (;;) {
    const LogStretch stretch = NextStretch(log, place, true);
    if (stretch.kind == LogStretch::Kind::kIncomplete) return;
    const auto gap = std::ranges::lower_bound(gaps, place.number, {}, &LogGap::first_event);
    const bool is_gap = gap != gaps.end() && gap->first_event < stretch.next.number && place.number < upto_;
    const bool is_damaged = stretch.kind == LogStretch::Kind::kDamaged;
    // A damaged stretch without a message is no hole.
    if (is_gap || (is_damaged && stretch.messages == 0)) {
      gaps_ += is_gap ? 1 : 0;
      missing_ += is_gap ? std::max<std::int64_t>(0, gap->messages) : 0;
      next_ = stretch.next.number;
      bytes_ = stretch.next.offset;
      if (stretch.kind == LogStretch::Kind::kSealed) chain_ = Crc32c(chain_, EncodeSeal(stretch.seal));
    } else {
      if (is_damaged && place.number < upto_) unexplained_.push_back(place.number);
      AddEvents(log, place.offset, stretch.next.offset);
    }
    place = stretch.next;
  }
}

}  // namespace axlecast
