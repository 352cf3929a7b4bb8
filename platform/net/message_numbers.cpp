#include "platform/net/message_numbers.h"

#include <algorithm>

namespace axlecast {

std::int64_t MessageNumbers::Behind(std::uint32_t number) const {
  return static_cast<std::int32_t>(next_ - number);
}

bool MessageNumbers::Came(std::uint32_t number) const {
  const std::uint32_t slot = number % kRemembered;
  return (came_[slot / 64] >> (slot % 64) & 1) != 0;
}

void MessageNumbers::Mark(std::uint32_t number, bool came) {
  const std::uint32_t slot = number % kRemembered;
  const std::uint64_t bit = std::uint64_t{1} << (slot % 64);
  came_[slot / 64] = came ? came_[slot / 64] | bit : came_[slot / 64] & ~bit;
}

void MessageNumbers::Begin(std::uint32_t number) {
  started_ = true;
  next_ = number;
  span_ = 0;
}

void MessageNumbers::Advance(std::int64_t ahead) {
  lost_ += ahead;
  span_ = std::min(span_ + ahead, kRemembered);
  next_ += static_cast<std::uint32_t>(ahead);
  for (std::int64_t i = 1; i <= std::min(ahead, kRemembered); ++i)
    Mark(next_ - static_cast<std::uint32_t>(i), false);
}

// Makes `number` one of the remembered or of before the beginning.
void MessageNumbers::Place(std::uint32_t number, std::int64_t utime) {
  const std::int64_t behind = Behind(number);
  const bool anew = number == 0 && behind > 0 && utime - heard_ >= kSilenceUs;
  if (!started_ || anew || behind > span_ + kStragglers || behind <= -kFarthestAhead) Begin(number);
  heard_ = utime;
  if (const std::int64_t now_behind = Behind(number); now_behind <= 0) Advance(1 - now_behind);
}

void MessageNumbers::Receive(std::uint32_t number, std::int64_t utime) {
  Place(number, utime);
  if (Behind(number) > span_) return;
  if (Came(number)) {
    ++repeated_;
    return;
  }
  --lost_;
  Mark(number, true);
}

bool MessageNumbers::Await(std::uint32_t number, std::int64_t utime) {
  Place(number, utime);
  return Behind(number) <= span_ && !Came(number);
}

}  // namespace axlecast
