#pragma once

#include <cstdint>
#include <optional>

#include "core/device/can.h"
#include "core/device/device.h"
#include "drivers/cia406/alarms.h"
#include "drivers/cia406/settings.h"
#include "drivers/protocol/canopen/sdo_client.h"

namespace axlecast::cia406 {

// Positions of one encoder, whichever way they come, towards the outside: samples with the interval that holds the
// sampling instant, errors, and the jump of a preset.
class PositionReader {
 public:
  // `late`: kSync, longest time from a SYNC to its TPDO.
  PositionReader(const Cia406Settings& settings, const CanFrameTime& time, MonoNs late, DeviceOutput& output);

  void OnLinkUp(MonoNs now);
  // A SYNC was on the bus: encoders sample from `from` on. `own`: this host has sent it.
  void OnSync(MonoNs from, bool own);
  // The frame of TPDO1. `synchronous`: it follows a SYNC.
  void OnTpdo(Bytes data, Interval received, bool synchronous, const NodeAlarms& alarms);
  // An answer to 6004h.
  void OnAnswer(const SdoResult& result, const NodeAlarms& alarms);

  // kSync: a TPDO may be that of an earlier SYNC. The answer to an SDO request tells that it is not: frames of a node come in
  // the order in which it has sent them.
  [[nodiscard]] bool in_doubt() const { return doubt_from_.has_value(); }
  // The node has answered a request that was sent at `sent`.
  void OnSdoAnswered(MonoNs sent);

  // The request for a preset was sent: from here to the first sample that surely shows its effect the datum
  // changes.
  void OnPresetSent();
  // It ended at `now`, whether or not an answer came.
  void OnPresetEnded(MonoNs now);
  void OnPresetRefused();

 private:
  void Give(std::uint32_t position, Interval at, const NodeAlarms& alarms);
  [[nodiscard]] Interval SampledAt(Interval received, std::size_t size, bool synchronous);

  const Cia406Settings& settings_;
  const CanFrameTime time_;
  const MonoNs late_;
  DeviceOutput& output_;
  std::optional<MonoNs> sync_from_;   // of the SYNC that no TPDO has followed yet
  bool own_sync_ = false;             // this host has sent it
  MonoNs last_own_sync_ = 0;          // whether or not a TPDO has followed
  std::optional<MonoNs> doubt_from_;  // of the oldest SYNC whose TPDO may still come
  bool changing_ = false;
  MonoNs effect_from_ = kNever;
};

}  // namespace axlecast::cia406
