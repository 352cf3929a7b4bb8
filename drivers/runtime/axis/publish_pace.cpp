#include "drivers/runtime/axis/publish_pace.h"

#include <axlecast/position_t.hpp>
#include <initializer_list>

namespace axlecast {

namespace {

constexpr std::int32_t Flags(std::initializer_list<std::int32_t> flags) {
  std::int32_t all = 0;
  for (const std::int32_t flag : flags) all |= flag;
  return all;
}

}  // namespace

const std::int32_t PublishPace::kStateFlags =
    Flags({position_t::FLAG_VALID, position_t::FLAG_TURNS_VALID, position_t::FLAG_TURNS_WRAPPED,
           position_t::FLAG_REFERENCED, position_t::FLAG_LOW_ACCURACY, position_t::FLAG_DEVICE_ERROR,
           position_t::FLAG_DEVICE_WARNING, position_t::FLAG_DATUM_CHANGING});

PublishPace::PublishPace(double publish_hz, double poll_hz)
    : every_(poll_hz > 0 && publish_hz >= poll_hz),
      period_(publish_hz > 0 ? static_cast<MonoNs>(static_cast<double>(kSecond) / publish_hz) : kNever),
      due_(publish_hz > 0 ? 0 : kNever) {}

bool PublishPace::Due(MonoNs at) {
  if (every_) return true;
  if (at < due_) return false;
  due_ = at - due_ < period_ ? due_ + period_ : at + period_;
  return true;
}

bool PublishPace::Good(MonoNs at, std::int32_t flags, std::int32_t epoch) {
  const std::int32_t state = flags & kStateFlags;
  bool send = Due(at) || doubt_shown_ || !any_ || epoch != epoch_;
  if (!send && state != state_ && at - extra_at_ >= kExtraPeriod) {
    extra_at_ = at;
    send = true;
  }
  in_doubt_ = false;
  if (!send) return false;
  any_ = true;
  doubt_shown_ = false;
  state_ = state;
  epoch_ = epoch;
  return true;
}

bool PublishPace::Doubtful(MonoNs at) {
  const bool send = at - doubt_at_ >= (in_doubt_ ? kDoubtPeriod : kExtraPeriod);
  in_doubt_ = true;
  if (!send) return false;
  doubt_at_ = at;
  doubt_shown_ = true;
  return true;
}

}  // namespace axlecast
