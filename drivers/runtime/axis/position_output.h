#pragma once

#include <axlecast/position_block_t.hpp>
#include <axlecast/position_t.hpp>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "core/messages/message.h"
#include "drivers/runtime/axis/axis.h"

namespace axlecast {

// Selects the readings that become POSITION messages.
//
// Good readings: at most publish_hz; on average exactly publish_hz if readings come faster. In addition, at once: the
// first good reading after a published doubtful one, a new datum epoch, and a change of state (the flags of
// kStateFlags), the last at most every 10 ms.
// Doubtful readings: the first of a row at once, but at most every 10 ms; then at 10 Hz until a good one comes. A line
// on which every other reading fails therefore cannot flood the network.
class PublishPace {
 public:
  // poll_hz 0: as fast as the bus allows. publish_hz 0: only what is published at once.
  PublishPace(double publish_hz, double poll_hz);

  [[nodiscard]] bool Good(MonoNs at, std::int32_t flags, std::int32_t epoch);
  [[nodiscard]] bool Doubtful(MonoNs at);

  static const std::int32_t kStateFlags;
  static constexpr MonoNs kExtraPeriod = 10 * kMillisecond;
  static constexpr MonoNs kDoubtPeriod = 100 * kMillisecond;

 private:
  [[nodiscard]] bool Due(MonoNs at);

  bool every_;  // every reading may be published
  MonoNs period_;
  MonoNs due_ = 0;
  bool any_ = false;
  std::int32_t state_ = 0;  // of the last good message
  std::int32_t epoch_ = 0;
  MonoNs extra_at_ = -kExtraPeriod;
  bool in_doubt_ = false;     // the last reading was doubtful
  bool doubt_shown_ = false;  // the last message was doubtful
  MonoNs doubt_at_ = -kDoubtPeriod;
};

// Collects readings at full rate for POSITION_BLOCK: up to 40 consecutive readings of one datum epoch, in ascending order
// of time, over at most 100 ms. Doubtful readings are included, with VALID cleared.
class Block {
 public:
  Block(std::int64_t counts_per_turn, std::int8_t unit, double unit_per_count);

  // Returns true if the block must be sent before this reading can be added.
  [[nodiscard]] bool MustGoBefore(MonoNs at, std::int32_t epoch) const;
  void Add(Interval at, std::int64_t counts, std::int32_t flags, std::int32_t epoch);
  // Counts a reading that failed or was withheld.
  void Miss() { ++message_.missed; }

  [[nodiscard]] bool Full() const { return message_.n == position_block_t::MAX_SAMPLES; }
  // Returns true if the block has waited for 100 ms.
  [[nodiscard]] bool Waited(MonoNs now) const;
  [[nodiscard]] bool empty() const { return message_.n == 0; }

  // Returns the message. The sender sets utime, boot_id and seq.
  [[nodiscard]] position_block_t& Take();
  // Empties the block after it was sent.
  void Clear();

  static constexpr MonoNs kLongest = 100 * kMillisecond;

 private:
  position_block_t message_;
};

// Publishes the readings of one axis: POSITION/<device> at the publish rate, and POSITION_BLOCK/<device> at full rate if it
// is configured.
class PositionOutput {
 public:
  struct Context {
    std::int64_t boot_id = 0;
    const Timebase* time = nullptr;
    MessageSink* sink = nullptr;
    std::int32_t flags = 0;  // of every message: SIMULATED, REDECODED
  };
  PositionOutput(const BusConfig& bus, const DeviceConfig& device, const Axis& axis, Context context);

  // `reading` is the result of Axis::Take(sample).
  void Take(const Sample& sample, const AxisReading& reading);
  // Counts a failed reading.
  void Miss();
  // Marks a gap: the link is down. No reading fails meanwhile.
  void Interrupt() { gap_ = any_good_; }
  void OnClockStepped() { clock_stepped_ = clock_stepped_in_block_ = true; }
  // Publishes a block that has waited for 100 ms.
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
  bool gap_to_send_ = false;  // and no message has reported it
  bool clock_stepped_ = false;
  bool clock_stepped_in_block_ = false;
};

}  // namespace axlecast
