#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>

#include "core/base/time.h"
#include "core/device/can.h"
#include "core/device/device.h"
#include "drivers/cia406/alarms.h"
#include "drivers/cia406/settings.h"
#include "drivers/protocol/canopen/canopen.h"
#include "drivers/protocol/canopen/sdo_client.h"

namespace axlecast::cia406 {

// Heartbeat consumer of one node (CiA 301 7.2.8.3.2.2): its last known NMT state, and whether its heartbeat is lost.
class NodeWatch {
 public:
  // `limit`: longest time between two heartbeats; 0: any.
  explicit NodeWatch(MonoNs limit) : limit_(limit) {}

  void Restart(MonoNs now) {
    Forget();
    last_ = now;
    lost_ = false;
  }
  // Makes the state unknown.
  void Forget() { state_.reset(); }
  // Sets the state that follows from a command to the node, or from what it sends. It holds until the next heartbeat.
  void Infer(NmtState state) {
    if (state_ == state) return;
    state_ = state;
    reported_ = false;
  }
  // Returns true when a loss ends.
  bool OnHeartbeat(NmtState state, MonoNs now) {
    // After boot-up a node enters pre-operational by itself (7.3.2.2.1).
    state_ = state == NmtState::kBootUp ? NmtState::kPreOperational : state;
    reported_ = true;
    last_ = now;
    return std::exchange(lost_, false);
  }
  // Returns true once for every loss.
  [[nodiscard]] bool BecameLost(MonoNs now) {
    if (now < due()) return false;
    lost_ = true;
    state_.reset();
    return true;
  }
  // Returns when the next heartbeat is overdue.
  [[nodiscard]] MonoNs due() const { return limit_ == 0 || lost_ ? kNever : last_ + limit_; }
  [[nodiscard]] std::optional<NmtState> state() const { return state_; }
  // Returns whether the state comes from a heartbeat.
  [[nodiscard]] bool reported() const { return reported_; }

 private:
  MonoNs limit_;
  MonoNs last_ = 0;
  bool lost_ = true;
  std::optional<NmtState> state_;
  bool reported_ = false;
};

// Passes the positions of one encoder to the output, in every mode: samples with the interval that contains the sampling
// time, errors, and the jump of a preset.
class PositionReader {
 public:
  // `late`: kSync, longest time from a SYNC to its TPDO.
  PositionReader(const Cia406Settings& settings, const CanFrameTime& time, MonoNs late, DeviceOutput& output)
      : settings_(settings), time_(time), late_(late), output_(output) {}

  void OnLinkUp(MonoNs now) {
    sync_from_.reset();
    last_own_sync_ = now;
    doubt_from_ = now - late_;  // an earlier process may have sent SYNC
  }
  // A SYNC was on the bus: encoders sample from `from` on. `own`: this host has sent it.
  void OnSync(MonoNs from, bool own) {
    // The TPDO of the SYNC before has not come.
    if (own && sync_from_ && own_sync_ && !doubt_from_) doubt_from_ = sync_from_;
    if (own) last_own_sync_ = from;
    sync_from_ = from;
    own_sync_ = own;
  }
  // The frame of TPDO1. `synchronous`: it follows a SYNC.
  void OnTpdo(Bytes data, Interval received, bool synchronous, const NodeAlarms& alarms) {
    const Interval at = SampledAt(received, data.size(), synchronous);
    if (data.size() < kPositionSize) return output_.OnError(ErrorKind::kShort, received);
    Publish(LittleEndian(data, 0, kPositionSize), at, alarms);
  }
  // An answer to 6004h.
  void OnAnswer(const SdoResult& result, const NodeAlarms& alarms) {
    Interval at{result.sent.first + time_.Shortest(kSdoSize), result.received.last - time_.Shortest(kSdoSize)};
    at.last = std::max(at.first, at.last);
    Publish(result.value, at, alarms);
  }

  // Returns, in mode kSync, whether a TPDO may be that of an earlier SYNC. The answer to an SDO request excludes this:
  // frames of a node arrive in the order in which it has sent them.
  [[nodiscard]] bool in_doubt() const { return doubt_from_.has_value(); }
  // The node has answered a request that was sent at `sent`.
  void OnSdoAnswered(MonoNs sent) {
    const MonoNs answered = sent - settings_.processing;
    if (!doubt_from_ || *doubt_from_ > answered) return;
    doubt_from_ = answered;
    if (last_own_sync_ <= answered) doubt_from_.reset();
  }

  // The request for a preset was sent. From then to the first sample that surely shows its effect, the datum changes.
  void OnPresetSent() {
    output_.OnNonVolatileWrite();  // some makers' encoders keep a preset at once
    effect_from_ = kNever;
    if (!std::exchange(changing_, true)) output_.OnDatumChanging(true);
  }
  // The transfer of the preset ended at `now`, with or without an answer.
  void OnPresetEnded(MonoNs now) {
    if (changing_) effect_from_ = now + settings_.preset_settle;
  }
  void OnPresetRefused() {
    if (std::exchange(changing_, false)) output_.OnDatumChanging(false);
  }

 private:
  void Publish(std::uint32_t position, Interval at, const NodeAlarms& alarms) {
    if (std::uint64_t{position} >> settings_.total_bits() != 0) {
      output_.OnError(ErrorKind::kRange, at);
      return;
    }
    if (changing_ && at.first >= effect_from_) {
      changing_ = false;
      output_.OnDatumChanging(false);
      output_.OnJump();
    }
    Sample sample;
    sample.at = at;
    sample.counts = position & ((std::uint32_t{1} << settings_.bits) - 1);
    sample.has_turns = settings_.turn_bits > 0;
    if (sample.has_turns) sample.turns = static_cast<std::int32_t>(position >> settings_.bits);
    sample.error = alarms.position_error();
    sample.warning = alarms.warning();
    sample.device_status = alarms.status();
    output_.OnSample(sample);
  }
  // A position was sampled at most `processing` before the first bit of its frame. In a frame that follows a SYNC, it was
  // sampled after the SYNC.
  [[nodiscard]] Interval SampledAt(Interval received, std::size_t size, bool synchronous) {
    const std::optional<MonoNs> sync = std::exchange(sync_from_, std::nullopt);
    Interval at{received.first - time_.Longest(size) - settings_.processing, received.last - time_.Shortest(size)};
    if (synchronous && sync) at.first = *sync;
    at.last = std::max(at.first, at.last);
    if (settings_.mode == Mode::kCyclic) return at;
    const MonoNs longest_ago = received.first - time_.Longest(size) - late_;
    if (doubt_from_) {
      at.first = std::min(at.first, std::max(*doubt_from_, longest_ago));
    } else if (!sync || !own_sync_) {
      at.first = std::min(at.first, longest_ago);
    }
    return at;
  }

  const Cia406Settings& settings_;
  const CanFrameTime time_;
  const MonoNs late_;
  DeviceOutput& output_;
  std::optional<MonoNs> sync_from_;   // of the SYNC that no TPDO has followed yet
  bool own_sync_ = false;             // this host has sent it
  MonoNs last_own_sync_ = 0;          // with or without a TPDO
  std::optional<MonoNs> doubt_from_;  // of the oldest SYNC whose TPDO may still come
  bool changing_ = false;
  MonoNs effect_from_ = kNever;
};

}  // namespace axlecast::cia406
