#include "drivers/runtime/axis/block.h"

#include <algorithm>

namespace axlecast {
namespace {

std::int32_t Narrow(std::int64_t ns) {
  return static_cast<std::int32_t>(std::clamp<std::int64_t>(ns, INT32_MIN, INT32_MAX));
}

}  // namespace

Block::Block(std::int64_t counts_per_turn, std::int8_t unit, double unit_per_count) : message_{} {
  message_.counts_per_turn = counts_per_turn;
  message_.unit = unit;
  message_.unit_per_count = unit_per_count;
  message_.dt_ns.reserve(position_block_t::MAX_SAMPLES);
  message_.time_uncertainty_ns.reserve(position_block_t::MAX_SAMPLES);
  message_.counts.reserve(position_block_t::MAX_SAMPLES);
  message_.flags.reserve(position_block_t::MAX_SAMPLES);
}

bool Block::MustGoBefore(MonoNs at, std::int32_t epoch) const {
  if (empty()) return false;
  const MonoNs dt = at - message_.mono_ns;
  return Full() || epoch != message_.datum_epoch || dt <= message_.dt_ns.back() || dt > kLongest;
}

void Block::Add(Interval at, std::int64_t counts, std::int32_t flags, std::int32_t epoch) {
  if (empty()) {
    message_.mono_ns = at.Middle();
    message_.datum_epoch = epoch;
  }
  message_.dt_ns.push_back(Narrow(at.Middle() - message_.mono_ns));
  message_.time_uncertainty_ns.push_back(Narrow(at.HalfWidth()));
  message_.counts.push_back(counts);
  message_.flags.push_back(flags);
  ++message_.n;
}

bool Block::Waited(MonoNs now) const { return !empty() && now - message_.mono_ns >= kLongest; }

position_block_t& Block::Take() { return message_; }

void Block::Clear() {
  message_.n = 0;
  message_.missed = 0;
  message_.dt_ns.clear();
  message_.time_uncertainty_ns.clear();
  message_.counts.clear();
  message_.flags.clear();
}

}  // namespace axlecast
