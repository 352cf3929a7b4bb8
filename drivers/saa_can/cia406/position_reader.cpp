#include "drivers/saa_can/cia406/position_reader.h"

#include <algorithm>
#include <utility>

namespace axlecast::saa_can::cia406 {
namespace {

constexpr std::size_t kPositionData = 4;
constexpr std::size_t kSdoData = 8;

}  // namespace

void PositionReader::OnTpdo(Bytes data, Interval received, bool synchronous, const NodeAlarms& alarms) {
  const std::optional<MonoNs> sync = std::exchange(sync_from_, std::nullopt);
  if (data.size() < kPositionData) {
    output_.OnError(ErrorKind::kShort, received);
    return;
  }
  Interval at{received.first - time_.Longest(data.size()) - settings_.processing,
              received.last - time_.Shortest(data.size())};
  if (synchronous && sync) at.first = *sync;
  at.last = std::max(at.first, at.last);
  Give(LittleEndian(data, 0, kPositionData), at, alarms);
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

}  // namespace axlecast::saa_can::cia406
