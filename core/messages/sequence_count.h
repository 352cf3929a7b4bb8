#pragma once

#include <cstdint>
#include <map>

namespace axlecast {

// Counts what was received and lost on one channel, by the sequence numbers of its messages. A new boot id is a new
// publisher, whose first number counts as the beginning: what it sent before is not missed.
class SequenceCount {
 public:
  void On(std::int64_t boot_id, std::int64_t seq);

  [[nodiscard]] std::int64_t received() const { return received_; }
  [[nodiscard]] std::int64_t lost() const { return lost_; }

 private:
  std::map<std::int64_t, std::int64_t> newest_;  // by boot id
  std::int64_t received_ = 0;
  std::int64_t lost_ = 0;
};

}  // namespace axlecast
