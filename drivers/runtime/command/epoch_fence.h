#pragma once

#include <cstdint>
#include <deque>

namespace axlecast {

// Keeps orders of the past from acting: those of a bridge boot that was replaced, and those that a newer order of
// any bridge has overtaken, so that a recorded order of a bridge that is long gone does not act either.
class EpochFence {
 public:
  enum class Verdict : std::uint8_t {
    kNewest,  // newer than everything before, of whichever bridge; now the newest
    kOlder,   // overtaken or repeated: only good for an answer, from which a new bridge learns newest()
    kFenced,  // from a bridge that was replaced
  };

  // A boot id never seen before becomes the present bridge with its first order above newest().
  [[nodiscard]] Verdict Judge(std::int64_t bridge_boot_id, std::int64_t bridge_epoch);
  // Newest epoch accepted from any bridge; 0 none.
  [[nodiscard]] std::int64_t newest() const { return newest_; }

 private:
  static constexpr std::size_t kRemembered = 64;  // replaced bridges

  std::int64_t present_ = 0;
  std::int64_t newest_ = 0;
  std::deque<std::int64_t> replaced_;
};

}  // namespace axlecast
