#include "drivers/saa_can/delivery.h"

#include <algorithm>

namespace axlecast::saa_can {

void Delivery::Start(const CanFrame& frame) {
  frame_ = frame;
  state_ = State::kStarted;
}

void Delivery::On(const Event& event, MonoNs now) {
  const Bytes data = frame_.data;
  const bool same =
      event.id == frame_.id && std::equal(event.bytes.begin(), event.bytes.end(), data.begin(), data.end());
  if (state_ == State::kStarted && same && event.kind == Event::Kind::kSent) {
    state_ = State::kQueued;
    at_ = now;
  } else if (state_ == State::kStarted && same && event.kind == Event::Kind::kNotSent) {
    state_ = State::kRefused;
  } else if (state_ == State::kQueued && same && event.kind == Event::Kind::kConfirmed) {
    state_ = State::kOnBus;
    at_ = now;
  } else if (state_ == State::kQueued && now >= due()) {
    state_ = State::kNotConfirmed;
  }
}

}  // namespace axlecast::saa_can
