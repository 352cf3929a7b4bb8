#pragma once

#include <cstddef>
#include <cstdint>
#include <map>

namespace axlecast {

// Counts what was received and lost on one channel, by the sequence numbers of its messages. A new boot id is a new
// publisher, whose first number counts as the beginning: what it sent before is not missed. A message that comes late is not lost; one that
// comes twice changes nothing. Of each publisher the last kGaps gaps are remembered: what comes later still stays lost.
class SequenceCount {
 public:
  void On(std::int64_t boot_id, std::int64_t seq);

  [[nodiscard]] std::int64_t received() const { return received_; }
  [[nodiscard]] std::int64_t lost() const { return lost_; }

 private:
  static constexpr std::size_t kGaps = 32;
  struct Publisher {
    std::int64_t newest = 0;
    std::map<std::int64_t, std::int64_t> gaps = {};  // the last missing number of each, by the first
  };

  void FillGap(Publisher& publisher, std::int64_t seq);

  std::map<std::int64_t, Publisher> publishers_;  // by boot id
  std::int64_t received_ = 0;
  std::int64_t lost_ = 0;
};

}  // namespace axlecast
