#pragma once

#include <array>
#include <cstdint>

#include "core/base/time.h"
#include "drivers/tsubaki_sc/answer.h"

namespace axlecast::tsubaki_sc {

// What is read beside the live data, item after item: once each when the unit appears, then one a second as far as
// the bus has turns for it.
class SlowPlan {
 public:
  // The unit has appeared: every item once, the MFG number first, because it tells one unit from another.
  void Restart();
  // Some item was not yet asked for since Restart.
  [[nodiscard]] bool introducing() const { return introduced_ < kItems.size(); }
  // The MFG number was not yet asked for since Restart.
  [[nodiscard]] bool identity_first() const { return introduced_ == 0; }
  [[nodiscard]] const Block& Next() const { return kItems[next_]; }
  [[nodiscard]] MonoNs due() const { return due_; }
  // Its own request is over. An item that the unit does not know is left out from now on.
  void OnAnswer(const Answer& answer);

 private:
  void Advance(MonoNs now);

  // The log interval stands in the last of the parameters' blocks.
  static constexpr std::array<Block, 10> kItems = {
      kMfgNumber,   kStopCoil, kLoginStatus, kParameterBlocks[2], kMains,
      kProductCode, kVersion,  kSetValues,   kParameterBlocks[0], kParameterBlocks[1]};
  static constexpr MonoNs kPeriod = 1 * kSecond;

  std::size_t next_ = 0;
  std::size_t introduced_ = 0;
  std::uint32_t unknown_ = 0;  // bit i: the unit refuses item i
  int failures_ = 0;
  MonoNs due_ = 0;
};

}  // namespace axlecast::tsubaki_sc
