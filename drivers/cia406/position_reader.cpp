#include "drivers/cia406/position_reader.h"

#include <algorithm>
#include <utility>

namespace axlecast::cia406 {
namespace {

constexpr std::size_t kPositionData = 4;
constexpr std::size_t kSdoData = 8;

}  // namespace

PositionReader::PositionReader(const Cia406Settings& settings, const CanFrameTime& time, MonoNs late,
                               DeviceOutput& output)
    : settings_(settings), time_(time), late_(late), output_(output) {}

void PositionReader::OnLinkUp(MonoNs now) {
  sync_from_.reset();
  last_own_sync_ = now;
  doubt_from_ = now - late_;  // an earlier process may have sent SYNC
}

void PositionReader::OnSync(MonoNs from, bool own) {
  // The TPDO of the SYNC before has not come.
  if (own && sync_from_ && own_sync_ && !doubt_from_) doubt_from_ = sync_from_;
  if (own) last_own_sync_ = from;
  sync_from_ = from;
  own_sync_ = own;
}

void PositionReader::OnSdoAnswered(MonoNs sent) {
  const MonoNs answered = sent - settings_.processing;
  if (!doubt_from_ || *doubt_from_ > answered) return;
  doubt_from_ = answered;
  if (last_own_sync_ <= answered) doubt_from_.reset();
}

void PositionReader::OnTpdo(Bytes data, Interval received, bool synchronous, const NodeAlarms& alarms) {
  const Interval at = SampledAt(received, data.size(), synchronous);
  if (data.size() < kPositionData) return output_.OnError(ErrorKind::kShort, received);
  Give(LittleEndian(data, 0, kPositionData), at, alarms);
}

// In time, a frame was sampled no longer than `processing` before its first bit. One that follows a SYNC was sampled
// after it.
Interval PositionReader::SampledAt(Interval received, std::size_t size, bool synchronous) {
  const std::optional<MonoNs> sync = std::exchange(sync_from_, std::nullopt);
  Interval at{received.first - time_.Longest(size) - settings_.processing, received.last - time_.Shortest(size)};
  if (synchronous && sync) at.first = *sync;
  at.last = std::max(at.first, at.last);
  if (settings_.mode == Mode::kCyclic) return at;
  const MonoNs longest_ago = received.first - time_.Longest(size) - late_;
  if (doubt_from_) {
    at.first = std::min(at.first, std::max(*doubt_from_, longest_ago));
  } else if (!sync || !own_sync_) {
    at.first = std::min(at.first, longest_ago);
  }
  return at;
}

void PositionReader::OnAnswer(const SdoResult& result, const NodeAlarms& alarms) {
  Interval at{result.sent.first + time_.Shortest(kSdoData), result.received.last - time_.Shortest(kSdoData)};
  at.last = std::max(at.first, at.last);
  Give(result.value, at, alarms);
}

void PositionReader::Give(std::uint32_t position, Interval at, const NodeAlarms& alarms) {
  if (std::uint64_t{position} >> settings_.total_bits() != 0) {
    output_.OnError(ErrorKind::kRange, at);
    return;
  }
  if (changing_ && at.first >= effect_from_) {
    changing_ = false;
    output_.OnDatumChanging(false);
    output_.OnJump();
  }
  Sample sample;
  sample.at = at;
  sample.counts = position & ((std::uint32_t{1} << settings_.bits) - 1);
  sample.has_turns = settings_.turn_bits > 0;
  if (sample.has_turns) sample.turns = static_cast<std::int32_t>(position >> settings_.bits);
  sample.error = alarms.position_error();
  sample.warning = alarms.warning();
  sample.device_status = alarms.status();
  output_.OnSample(sample);
}

void PositionReader::OnPresetSent() {
  output_.OnNonVolatileWrite();  // some makers' encoders keep a preset at once
  effect_from_ = kNever;
  if (!std::exchange(changing_, true)) output_.OnDatumChanging(true);
}

void PositionReader::OnPresetEnded(MonoNs now) {
  if (changing_) effect_from_ = now + settings_.preset_settle;
}

void PositionReader::OnPresetRefused() {
  if (std::exchange(changing_, false)) output_.OnDatumChanging(false);
}

}  // namespace axlecast::cia406
