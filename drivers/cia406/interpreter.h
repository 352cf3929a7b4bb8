#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "core/base/time.h"
#include "core/device/can.h"
#include "core/device/device.h"
#include "drivers/cia406/alarms.h"
#include "drivers/cia406/node_facts.h"
#include "drivers/cia406/settings.h"
#include "drivers/kit/stream.h"
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

  void OnLinkUp(MonoNs now);
  // A SYNC was on the bus: encoders sample from `from` on. `own`: this host has sent it.
  void OnSync(MonoNs from, bool own);
  // The frame of TPDO1. `synchronous`: it follows a SYNC.
  void OnTpdo(Bytes data, Interval received, bool synchronous, const NodeAlarms& alarms);
  // An answer to 6004h.
  void OnAnswer(const SdoResult& result, const NodeAlarms& alarms);

  // Returns, in mode kSync, whether a TPDO may be that of an earlier SYNC. The answer to an SDO request excludes this:
  // frames of a node arrive in the order in which it has sent them.
  [[nodiscard]] bool in_doubt() const { return doubt_from_.has_value(); }
  // The node has answered a request that was sent at `sent`.
  void OnSdoAnswered(MonoNs sent);

  // The request for a preset was sent. From then to the first sample that surely shows its effect, the datum changes.
  void OnPresetSent();
  // The transfer of the preset ended at `now`, with or without an answer.
  void OnPresetEnded(MonoNs now);
  void OnPresetRefused();

 private:
  void Publish(std::uint32_t position, Interval at, const NodeAlarms& alarms);
  [[nodiscard]] Interval SampledAt(Interval received, std::size_t size, bool synchronous);

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

// Evaluates the events of one node: its identity, its state and its position, which it passes to the output. It determines
// what must be read from the node or sent to it. All of this follows from the events alone, so a recorded sequence of
// events gives the same results again.
//
// Nothing is published before the node was identified. After it was silent or has restarted, it must be identified again:
// in the meantime it may have been exchanged.
class Interpreter {
 public:
  Interpreter(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output);

  void OnLinkUp(MonoNs now);
  void OnLinkDown(MonoNs now);
  // Receives any other event. Returns the SDO transfer that it ended, whatever its purpose.
  std::optional<SdoResult> Evaluate(const Event& event);

  // Returns whether the node is the configured encoder, and answers.
  [[nodiscard]] bool running() const { return stage_ == Stage::kRunning; }
  [[nodiscard]] const SdoClient& client() const { return client_; }
  [[nodiscard]] const NodeAlarms& alarms() const { return alarms_; }
  [[nodiscard]] const NodeWatch& watch() const { return watch_; }

  // Returns the frame that must be sent as soon as the bus allows: the end of a transfer, an NMT command.
  [[nodiscard]] std::optional<CanFrame> UrgentFrame(MonoNs now) const;
  // Returns the object that must be read before all others: a fence, or a fact.
  [[nodiscard]] std::optional<ObjectId> FirstObject(MonoNs now) const;
  // Returns the offset, alarms or warnings, when it is time to read them again.
  [[nodiscard]] std::optional<ObjectId> DiagnosticObject(MonoNs now) const;
  // Returns whether any node has sent a frame recently, so that sending SYNC is useful.
  [[nodiscard]] bool BusIsAlive(MonoNs now) const { return now - last_frame_at_ < kDeadAfter; }
  // Returns when the device must be evaluated again if nothing happens before.
  [[nodiscard]] MonoNs Due(MonoNs now) const;

 private:
  enum class Stage : std::uint8_t { kIdentifying, kRunning, kRefused };
  static constexpr MonoNs kDeadAfter = 1 * kSecond;

  void OnFrame(const Event& event);
  void OnOwnFrame(const Event& event);
  void OnHeartbeat(const Event& event);
  void OnTpdo(const Event& event);
  void OnSync(const Event& event, bool own);
  void OnResult(const SdoResult& result);
  void OnTime(MonoNs now);
  void OnDiagnostics(const SdoResult& result);
  void Identify(MonoNs now);
  void CheckNode(MonoNs now);
  void Accept(MonoNs now);
  void Refuse(const std::string& reason, MonoNs now);
  void ShowNmtState(MonoNs now);
  [[nodiscard]] std::optional<NmtCommand> NeededCommand() const;
  // Returns whether the node sends positions, as far as is known.
  [[nodiscard]] bool Operates() const;
  // Returns whether it does so by itself.
  [[nodiscard]] bool Streams() const;
  [[nodiscard]] bool Answers(ObjectId object) const { return facts_.Get(object).has_value(); }

  const Cia406Settings& settings_;
  const bool produces_sync_;
  const CanFrameTime time_;
  DeviceOutput& output_;
  SdoClient client_;
  NodeFacts facts_;
  NodeAlarms alarms_;
  NodeWatch watch_;
  PositionReader positions_;
  PeriodMonitor monitor_;

  Stage stage_ = Stage::kIdentifying;
  std::string refusal_;  // as it was published; empty if it was not
  std::optional<std::uint32_t> last_serial_;
  std::optional<std::uint32_t> last_product_;
  std::optional<std::uint32_t> last_offset_;
  bool identified_before_ = false;
  MonoNs last_frame_at_ = 0;  // of any node
  MonoNs retry_at_ = 0;       // of a node that does not answer
  MonoNs recheck_at_ = 0;     // of a node that was refused
  MonoNs command_at_ = 0;     // no NMT command before this time
  MonoNs operate_by_ = 0;     // from this time on, the alarm not_operational is possible
  bool not_operational_ = false;
  bool second_sync_ = false;
  int missed_syncs_ = 0;    // in a row
  bool sync_open_ = false;  // a SYNC that no position has followed
  MonoNs sync_sent_ = 0;
  MonoNs diagnostics_at_ = 0;
  bool warnings_next_ = false;
};

}  // namespace axlecast::cia406
