#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/base/time.h"
#include "core/device/device.h"
#include "drivers/cia406/alarms.h"
#include "drivers/cia406/node_facts.h"
#include "drivers/cia406/position_reader.h"
#include "drivers/cia406/settings.h"
#include "drivers/kit/stream.h"
#include "drivers/protocol/canopen/canopen.h"
#include "drivers/protocol/canopen/sdo_client.h"

namespace axlecast::cia406 {

// Heartbeat consumer of one node (CiA 301 7.2.8.3.2.2): its NMT state as it last said, and whether it still says
// so.
class NodeWatch {
 public:
  // `limit`: longest time between two heartbeats; 0: any.
  explicit NodeWatch(MonoNs limit) : limit_(limit) {}

  void Restart(MonoNs now) {
    Doubt();
    last_ = now;
    lost_ = false;
  }
  // Nothing is known of its state any more.
  void Doubt() { state_.reset(); }
  // Its state by what it was told, or by what it sends, until it says otherwise.
  void Infer(NmtState state) {
    if (state_ == state) return;
    state_ = state;
    said_ = false;
  }
  // True when a loss ends.
  bool Heard(NmtState state, MonoNs now) {
    // After boot-up a node enters pre-operational by itself (7.3.2.2.1).
    state_ = state == NmtState::kBootUp ? NmtState::kPreOperational : state;
    said_ = true;
    last_ = now;
    const bool ended = lost_;
    lost_ = false;
    return ended;
  }
  // True once for every loss.
  [[nodiscard]] bool BecameLost(MonoNs now) {
    if (now < due()) return false;
    lost_ = true;
    state_.reset();
    return true;
  }
  // When the next heartbeat is to be missed.
  [[nodiscard]] MonoNs due() const { return limit_ == 0 || lost_ ? kNever : last_ + limit_; }
  [[nodiscard]] std::optional<NmtState> state() const { return state_; }
  // The state is as the node said itself.
  [[nodiscard]] bool said() const { return said_; }

 private:
  MonoNs limit_;
  MonoNs last_ = 0;
  bool lost_ = true;
  std::optional<NmtState> state_;
  bool said_ = false;
};

// What one node says, towards the outside: who it is, how it is, where its shaft is; and what it must be asked or
// told so that it goes on. All of it follows from the events alone, so a recorded sequence of events gives the same
// again.
//
// Nothing is published before the node was identified, nor after it was silent or has started anew until it was
// identified again: in between it may have been exchanged.
class Interpreter {
 public:
  Interpreter(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output);

  void OnLinkUp(MonoNs now);
  void OnLinkDown(MonoNs now);
  // Any other event. The SDO transfer that it ended, whoever had asked for it.
  std::optional<SdoResult> Take(const Event& event);

  // It is the configured encoder, and answers.
  [[nodiscard]] bool running() const { return stage_ == Stage::kRunning; }
  [[nodiscard]] const SdoClient& client() const { return client_; }
  [[nodiscard]] const NodeFacts& facts() const { return facts_; }
  [[nodiscard]] const NodeAlarms& alarms() const { return alarms_; }
  [[nodiscard]] const NodeWatch& watch() const { return watch_; }

  // To be sent as soon as the bus allows: the end of a transfer, an NMT command.
  [[nodiscard]] std::optional<CanFrame> UrgentFrame(MonoNs now) const;
  // The object to be read before all others: a fence, or a fact.
  [[nodiscard]] std::optional<ObjectId> FirstObject(MonoNs now) const;
  // Alarms or warnings, when it is time to read them again.
  [[nodiscard]] std::optional<ObjectId> DiagnosticObject(MonoNs now) const;
  // Some node was heard lately: sending SYNC is not in vain.
  [[nodiscard]] bool BusIsAlive(MonoNs now) const { return now - heard_ < kDeadAfter; }
  // When it wants to be asked again, or told that time has passed.
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
  void OnPresetResult(const SdoResult& result);
  void OnDiagnostics(const SdoResult& result);
  void Identify(MonoNs now);
  void Judge(MonoNs now);
  void Accept(MonoNs now);
  void Refuse(const std::string& reason, MonoNs now);
  void ShowNmtState(MonoNs now);
  [[nodiscard]] std::optional<NmtCommand> WantedCommand() const;
  // It sends positions, as far as is known.
  [[nodiscard]] bool Operates() const;
  // The same, by itself.
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
  PeriodMonitor cadence_;

  Stage stage_ = Stage::kIdentifying;
  std::string refusal_;  // as it was told to the outside; empty: it was not
  std::optional<std::uint32_t> last_serial_;
  std::optional<std::uint32_t> last_product_;
  std::optional<std::uint32_t> last_offset_;
  bool identified_before_ = false;
  MonoNs heard_ = 0;       // any node
  MonoNs retry_at_ = 0;    // of a node that does not answer
  MonoNs recheck_at_ = 0;  // of one that was refused
  MonoNs command_at_ = 0;  // not before: NMT
  MonoNs operate_by_ = 0;  // it counts as not operational from here on
  bool not_operational_ = false;
  bool second_sync_ = false;
  int missed_syncs_ = 0;    // in a row
  bool sync_open_ = false;  // a SYNC that no position has followed
  MonoNs sync_sent_ = 0;
  MonoNs diagnostics_at_ = 0;
  bool warnings_next_ = false;
};

}  // namespace axlecast::cia406
