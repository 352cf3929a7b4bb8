#pragma once

#include <axlecast/position_t.hpp>
#include <cstdint>
#include <optional>
#include <string>

#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "core/messages/message.h"
#include "drivers/runtime/axis/axis.h"
#include "drivers/runtime/axis/block.h"
#include "drivers/runtime/axis/publish_pace.h"

namespace axlecast {

// Sends the readings of one axis: POSITION/<device> at the publish rate, POSITION_BLOCK/<device> at full rate where
// the configuration asks for it.
class PositionOutput {
 public:
  struct Context {
    std::int64_t boot_id = 0;
    const Timebase* time = nullptr;
    MessageSink* sink = nullptr;
    std::int32_t flags = 0;  // of every message: SIMULATED, REDECODED
  };
  PositionOutput(const BusConfig& bus, const DeviceConfig& device, const Axis& axis, Context context);

  // `reading` is what `axis` made of `sample`.
  void Take(const Sample& sample, const AxisReading& reading);
  // A reading failed.
  void Miss();
  // The line was lost: no reading fails meanwhile, but there is a gap.
  void Interrupt() { gap_ = any_good_; }
  void OnClockStepped() { clock_stepped_ = clock_stepped_in_block_ = true; }
  // Sends a block that has waited for 100 ms.
  void Tick(MonoNs now);

 private:
  void SendPosition(const Sample& sample, const AxisReading& reading, std::int32_t flags);
  void AddToBlock(const Sample& sample, const AxisReading& reading, std::int32_t flags);
  void SendBlock();

  const Axis& axis_;
  Context context_;
  std::string channel_;
  std::string block_channel_;
  PublishPace pace_;
  position_t position_;
  std::optional<Block> block_;
  std::int64_t block_seq_ = 0;
  bool any_good_ = false;
  bool gap_ = false;          // readings were missed since the last good one
  bool gap_to_send_ = false;  // ... and no message has said so
  bool clock_stepped_ = false;
  bool clock_stepped_in_block_ = false;
};

}  // namespace axlecast
