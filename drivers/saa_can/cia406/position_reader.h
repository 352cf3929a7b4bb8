#pragma once

#include <cstdint>
#include <optional>

#include "drivers/runtime/core/device.h"
#include "drivers/saa_can/cia406/frame_time.h"
#include "drivers/saa_can/cia406/node_alarms.h"
#include "drivers/saa_can/cia406/sdo_client.h"
#include "drivers/saa_can/cia406/settings.h"

namespace axlecast::saa_can::cia406 {

// Positions of one encoder, whichever way they come, towards the outside: samples with the interval that holds the
// sampling instant, errors, and the jump of a preset.
class PositionReader {
 public:
  PositionReader(const Cia406Settings& settings, const FrameTime& time, DeviceOutput& output)
      : settings_(settings), time_(time), output_(output) {}

  // A SYNC was on the bus: encoders sample from `from` on.
  void OnSync(MonoNs from) { sync_from_ = from; }
  // The frame of TPDO1. `synchronous`: it follows a SYNC.
  void OnTpdo(Bytes data, Interval received, bool synchronous, const NodeAlarms& alarms);
  // An answer to 6004h.
  void OnAnswer(const SdoResult& result, const NodeAlarms& alarms);

  // The request for a preset was sent: from here to the first sample that surely shows its effect the datum
  // changes.
  void OnPresetSent();
  // It ended at `now`, whether or not an answer came.
  void OnPresetEnded(MonoNs now);
  void OnPresetRefused();

 private:
  void Give(std::uint32_t position, Interval at, const NodeAlarms& alarms);

  const Cia406Settings& settings_;
  const FrameTime time_;
  DeviceOutput& output_;
  std::optional<MonoNs> sync_from_;  // of the SYNC that no TPDO has followed yet
  bool changing_ = false;
  MonoNs effect_from_ = kNever;
};

}  // namespace axlecast::saa_can::cia406
