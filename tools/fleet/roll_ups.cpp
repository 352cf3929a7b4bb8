#include "tools/fleet/roll_ups.h"

#include <algorithm>
#include <map>
#include <utility>

#include "core/device/reading.h"

namespace axlecast {
namespace {

constexpr std::int64_t kSecondUs = 1'000'000;
constexpr std::int64_t kMinuteUs = 60 * kSecondUs;

std::int64_t BeginOf(std::int64_t utime, std::int64_t period) { return utime - FloorMod(utime, period); }

void Join(SampleSummary& sum, const SampleSummary& other) {
  if (other.valid > 0) {
    const double weight = static_cast<double>(other.valid) / static_cast<double>(sum.valid + other.valid);
    sum.mean = sum.valid == 0 ? other.mean : std::optional(*sum.mean + (*other.mean - *sum.mean) * weight);
    sum.lo = sum.lo ? std::min(*sum.lo, *other.lo) : *other.lo;
    sum.hi = sum.hi ? std::max(*sum.hi, *other.hi) : *other.hi;
  }
  sum.n += other.n;
  sum.valid += other.valid;
  sum.missed = std::min<std::int64_t>(sum.missed + other.missed, INT32_MAX);
  sum.flags_or |= other.flags_or;
  sum.flags_and &= other.flags_and;
}

}  // namespace

void RollUps::Add(const StreamKey& key, const PositionSample& sample, BatchRows& batch) {
  const bool continues = second_ && sample.utime >= second_->begin && sample.utime < second_->begin + kSecondUs;
  if (!continues || second_->key != key) {
    EndSecond(batch);
    second_.emplace(Second{.key = key,
                           .begin = BeginOf(sample.utime, kSecondUs),
                           .minute = &minutes_[{key, BeginOf(sample.utime, kMinuteUs)}]});
  }
  second_->summary.Add(sample);
  second_->minute->Add(sample);
}

void RollUps::EndSecond(BatchRows& batch) {
  if (!second_) return;
  batch.seconds.push_back(
      {.t = second_->begin, .summary = second_->summary.Summary(), .stream = batch.IndexOf(second_->key)});
  second_.reset();
}

void RollUps::End(BatchRows& batch) {
  EndSecond(batch);
  for (const auto& [minute, summary] : minutes_) {
    batch.minutes.push_back(
        {.t = minute.second, .summary = summary.Summary(), .stream = batch.IndexOf(minute.first)});
  }
  minutes_.clear();
}

void JoinRollUps(std::vector<RollUpRow>& rows) {
  std::map<std::pair<std::size_t, std::int64_t>, RollUpRow> joined;
  for (const RollUpRow& row : rows) {
    const auto [place, is_new] = joined.try_emplace({row.stream, row.t}, row);
    if (!is_new) Join(place->second.summary, row.summary);
  }
  rows.clear();
  for (const auto& [key, row] : joined) rows.push_back(row);
}

}  // namespace axlecast
