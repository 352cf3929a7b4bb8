#pragma once

#include <array>
#include <cstdint>

namespace axlecast {

// The usual time between the messages of a channel, found from all of them.
class MessageGap {
 public:
  void On(std::int64_t us);

  // us. No usual time is as long: 8 times the median, which is known to a power of two.
  [[nodiscard]] std::int64_t Limit() const;

 private:
  static constexpr std::size_t kPowers = 48;
  std::array<std::int64_t, kPowers> counts_{};  // by the power of two that is above the time between
  std::int64_t total_ = 0;
  std::int64_t last_us_ = -1;
};

}  // namespace axlecast
