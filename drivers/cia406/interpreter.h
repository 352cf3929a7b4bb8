#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "core/base/time.h"
#include "core/device/can.h"
#include "core/device/device.h"
#include "core/device/operation.h"
#include "drivers/cia406/alarms.h"
#include "drivers/cia406/node_facts.h"
#include "drivers/cia406/position_reader.h"
#include "drivers/cia406/settings.h"
#include "drivers/kit/stream.h"
#include "drivers/protocol/canopen/canopen.h"
#include "drivers/protocol/canopen/sdo_client.h"

namespace axlecast::cia406 {

// Evaluates the events of one node: its identity, its state and its position, which it passes to the output. It determines
// what must be read from the node or sent to it. All of this follows from the events alone, so a recorded sequence of
// events gives the same results again.
//
// Nothing is published before the node was identified. After it was silent or has restarted, it must be identified again:
// in the meantime it may have been exchanged.
class Interpreter {
 public:
  Interpreter(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output)
      : settings_(Own(device)),
        produces_sync_(ProducesSync(bus, device)),
        time_{bus.simulate ? 0 : bus.link.bitrate},
        output_(output),
        client_(settings_.node, settings_.sdo_timeout, std::max(bus.late, settings_.sdo_timeout)),
        facts_(settings_.mode),
        alarms_(output),
        watch_(settings_.heartbeat),
        positions_(settings_, time_, bus.late, output),
        monitor_(settings_.period, kPeriodsToSilence) {}

  void OnLinkUp(MonoNs now) {
    client_.Reset();
    positions_.OnLinkUp(now);
    watch_.Restart(now);
    last_frame_at_ = now;
    retry_at_ = now;
    command_at_ = now;
    Identify(now);
    output_.OnStarting("no answer yet from the node");
  }
  void OnLinkDown(MonoNs now) {
    positions_.OnPresetEnded(now);
    client_.Reset();
    Identify(now);
  }
  // Receives any other event. Returns the SDO transfer that it ended, whatever its purpose.
  std::optional<SdoResult> Evaluate(const Event& event) {
    const MonoNs now = event.received.last;
    if (Event::IsFrame(event.kind) && (event.id & kCanError) != 0) return std::nullopt;
    if (event.kind == Event::Kind::kFrame) last_frame_at_ = now;
    const SdoClient::Evaluation evaluation = client_.On(event);
    if (evaluation.unexpected_answer) output_.OnError(ErrorKind::kWrongEcho, event.received);
    if (event.kind == Event::Kind::kFrame) OnFrame(event);
    if (event.kind == Event::Kind::kSent) OnOwnFrame(event);
    if (evaluation.result) OnResult(*evaluation.result);
    OnTime(now);
    return evaluation.result;
  }

  // Returns whether the event is the node's boot-up message.
  [[nodiscard]] bool IsBootUp(const Event& event) const {
    return event.kind == Event::Kind::kFrame && event.id == kHeartbeatId + settings_.node &&
           ParseHeartbeat(event.bytes) == NmtState::kBootUp;
  }
  // Returns whether the node is the configured encoder, and answers.
  [[nodiscard]] bool running() const { return stage_ == Stage::kRunning; }
  [[nodiscard]] const SdoClient& client() const { return client_; }
  [[nodiscard]] const NodeAlarms& alarms() const { return alarms_; }
  [[nodiscard]] const NodeWatch& watch() const { return watch_; }

  // Returns the frame that must be sent as soon as the bus allows: the end of a transfer, an NMT command.
  [[nodiscard]] std::optional<CanFrame> UrgentFrame(MonoNs now) const {
    if (client_.abort()) return client_.abort();
    const std::optional<NmtCommand> command = NeededCommand();
    if (!command || now < command_at_) return std::nullopt;
    return NmtFrame(*command, settings_.node);
  }
  // Returns the object that must be read before all others: a fence, or a fact.
  [[nodiscard]] std::optional<ObjectId> FirstObject(MonoNs now) const {
    if (!client_.free() || now < retry_at_) return std::nullopt;
    if (client_.fence()) return client_.fence();
    if (running() && settings_.mode == Mode::kSync && positions_.in_doubt()) return kPosition;
    return stage_ == Stage::kIdentifying ? facts_.Missing() : std::nullopt;
  }
  // Returns the offset, alarms or warnings, when it is time to read them again.
  [[nodiscard]] std::optional<ObjectId> DiagnosticObject(MonoNs now) const {
    if (!running()) return std::nullopt;
    if (!last_offset_ && Answers(kOffset)) return kOffset;  // a preset has changed it
    if (settings_.diagnostics == 0 || now < diagnostics_at_) return std::nullopt;
    if (warnings_next_) return Answers(kWarnings) ? std::optional(kWarnings) : std::nullopt;
    return kAlarms;
  }
  // Returns whether any node has sent a frame recently, so that sending SYNC is useful.
  [[nodiscard]] bool BusIsAlive(MonoNs now) const { return now - last_frame_at_ < kDeadAfter; }
  // Returns when the device must be evaluated again if nothing happens before.
  [[nodiscard]] MonoNs Due(MonoNs now) const {
    MonoNs due = std::min(client_.due(), watch_.due());
    if (Streams()) due = std::min(due, monitor_.due());
    if (stage_ == Stage::kRefused) due = std::min(due, recheck_at_);
    const auto later = [&](MonoNs at) {
      if (at > now) due = std::min(due, at);
    };
    if (client_.free() && !running()) later(retry_at_);
    if (client_.free() && running() && settings_.diagnostics > 0) later(diagnostics_at_);
    if (client_.fence()) later(retry_at_);
    if (NeededCommand()) later(command_at_);
    return due;
  }

 private:
  enum class Stage : std::uint8_t { kIdentifying, kRunning, kRefused };
  static constexpr int kPeriodsToSilence = 3;
  // Transfers, or SYNCs, in a row without an answer after which the node counts as gone.
  static constexpr int kGone = 2;
  static constexpr int kMaxMissedSyncs = 3;
  static constexpr MonoNs kRetry = 500 * kMillisecond;
  static constexpr MonoNs kRecheck = 2 * kSecond;
  static constexpr MonoNs kCommandPause = 1 * kSecond;
  // From the command to the heartbeat that shows its effect, at the slowest usual producer time.
  static constexpr MonoNs kOperateWithin = 3 * kSecond;
  static constexpr std::size_t kPositionAndStatus = 6;
  static constexpr MonoNs kDeadAfter = 1 * kSecond;

  void OnFrame(const Event& event) {
    if (event.id == kSyncId) return OnSync(event, false);
    if (event.id == kHeartbeatId + settings_.node) return OnHeartbeat(event);
    if (event.id == settings_.cob_id && settings_.mode != Mode::kPolled) return OnTpdo(event);
    if (event.id != kEmergencyId + settings_.node) return;
    if (const auto emergency = ParseEmergency(event.bytes)) {
      alarms_.OnEmergency(*emergency, event.received.last);
    } else {
      output_.OnError(ErrorKind::kShort, event.received);
    }
  }
  void OnOwnFrame(const Event& event) {
    const MonoNs now = event.received.last;
    if (event.id == kSyncId) return OnSync(event, true);
    if (event.id == kSdoRequestId + settings_.node) {
      const std::optional<SdoRequest> request = ParseRequest(event.bytes);
      if (!request || !request->write) return;
      if (request->object == kPreset) {
        positions_.OnPresetSent();
        last_offset_.reset();
      }
      if (request->object == kStoreAll) output_.OnNonVolatileWrite();
      return;
    }
    if (event.id != kNmtId || event.bytes.size() != 2 || event.bytes[1] != settings_.node) return;
    command_at_ = now + kCommandPause;
    const auto command = static_cast<NmtCommand>(event.bytes[0]);
    if (command == NmtCommand::kStart) watch_.Infer(NmtState::kOperational);
    if (command == NmtCommand::kEnterPreOperational) watch_.Infer(NmtState::kPreOperational);
    monitor_.Arrived(now);
  }
  void OnHeartbeat(const Event& event) {
    const MonoNs now = event.received.last;
    const std::optional<NmtState> state = ParseHeartbeat(event.bytes);
    if (!state) return output_.OnError(ErrorKind::kAbnormalReply, event.received);
    if (watch_.OnHeartbeat(*state, now)) output_.OnAlarm(kHeartbeatLost, AlarmState::kAbsent, now);
    if (*state == NmtState::kBootUp) {
      alarms_.OnBootUp(now);
      positions_.OnPresetEnded(now);
      client_.Reset();
      retry_at_ = now;
      if (refusal_.empty()) output_.OnStarting("the node has restarted (boot-up message): identifying it");
      Identify(now);
    }
    ShowNmtState(now);
  }
  void OnTpdo(const Event& event) {
    const MonoNs now = event.received.last;
    sync_open_ = false;
    missed_syncs_ = 0;
    if (stage_ == Stage::kRefused) return output_.OnError(ErrorKind::kWrongIdentity, event.received);
    if (!running()) return;
    watch_.Infer(NmtState::kOperational);  // no other state has PDOs (7.3.2.2.5)
    monitor_.Arrived(now);
    ShowNmtState(now);
    const bool status = facts_.Get(kTpdoSecond) == kMappedAlarms;
    if (status && event.bytes.size() >= kPositionAndStatus) {
      alarms_.OnAlarms(LittleEndian(event.bytes, 4, 2), now);
    }
    positions_.OnTpdo(event.bytes, event.received, facts_.synchronous(), alarms_);
  }
  void OnSync(const Event& event, bool own) {
    const MonoNs now = event.received.last;
    positions_.OnSync(own ? event.received.first + time_.Shortest(0) : event.received.first - time_.Shortest(0),
                      own);
    if (!own) {
      if (produces_sync_ && !std::exchange(second_sync_, true))
        output_.OnAlarm(kSecondSync, AlarmState::kLive, now);
      return;
    }
    if (settings_.mode != Mode::kSync) return;
    const bool missed = sync_open_ && running();
    const Interval since{sync_sent_, now};
    sync_open_ = Operates();
    sync_sent_ = event.received.first;
    if (!missed) return;
    output_.OnError(ErrorKind::kTimeout, since);
    if (++missed_syncs_ >= kMaxMissedSyncs && now >= monitor_.due()) {
      watch_.Forget();
      Identify(now);
    }
  }
  void OnResult(const SdoResult& result) {
    const MonoNs now = result.received.last;
    if (result.kind == SdoResult::Kind::kTimedOut) {
      output_.OnError(ErrorKind::kTimeout, {result.sent.first, now});
      retry_at_ = client_.silent_in_a_row() < kGone ? now : now + kRetry;
    } else {
      positions_.OnSdoAnswered(result.sent.first);
    }
    if (result.kind == SdoResult::Kind::kSegmented) output_.OnError(ErrorKind::kAbnormalReply, result.received);
    if (result.request.object == kPreset && result.request.write) {
      result.kind == SdoResult::Kind::kAborted ? positions_.OnPresetRefused() : positions_.OnPresetEnded(now);
    }
    facts_.On(result);
    if (running()) {
      OnDiagnostics(result);
      const bool position = result.request.object == kPosition && !result.request.write;
      if (settings_.mode != Mode::kPolled) return;
      if (position && result.kind == SdoResult::Kind::kAborted)
        output_.OnError(ErrorKind::kException, result.received);
      if (position && result.kind == SdoResult::Kind::kValue) positions_.OnAnswer(result, alarms_);
      if (client_.silent_in_a_row() >= kGone) Identify(now);
    } else if (stage_ == Stage::kIdentifying && facts_.complete() && !client_.fence()) {
      CheckNode(now);
    }
  }
  void OnTime(MonoNs now) {
    if (watch_.BecameLost(now)) {
      output_.OnAlarm(kHeartbeatLost, AlarmState::kLive, now);
      ShowNmtState(now);
    }
    if (stage_ == Stage::kRefused && now >= recheck_at_) {
      stage_ = Stage::kIdentifying;
      facts_.Forget();
    }
    if (Streams() && monitor_.FellSilent(now)) {
      output_.OnError(ErrorKind::kSilent, {now, now});
      watch_.Forget();
      Identify(now);
    }
  }
  void OnDiagnostics(const SdoResult& result) {
    const MonoNs now = result.received.last;
    if (result.request.object == kOffset && result.kind == SdoResult::Kind::kValue) last_offset_ = result.value;
    const bool of_alarms = result.request.object == kAlarms;
    if (!of_alarms && result.request.object != kWarnings) return;
    if (result.kind == SdoResult::Kind::kValue && of_alarms) alarms_.OnAlarms(result.value, now);
    if (result.kind == SdoResult::Kind::kValue && !of_alarms) alarms_.OnWarnings(result.value, now);
    const bool both = Answers(kAlarms) && Answers(kWarnings);
    warnings_next_ = both ? of_alarms : Answers(kWarnings);
    if (!both || !of_alarms) diagnostics_at_ = now + settings_.diagnostics;
  }
  void Identify(MonoNs now) {
    facts_.Forget();
    stage_ = Stage::kIdentifying;
    sync_open_ = false;
    missed_syncs_ = 0;
    ShowNmtState(now);
  }
  void CheckNode(MonoNs now) {
    const auto revision = facts_.Get(kRevision).value_or(0);
    const auto serial = facts_.Get(kSerial);
    const auto identity = std::int64_t{facts_.Get(kVendor).value_or(0)} << 32 | facts_.Get(kProduct).value_or(0);
    output_.OnIdentity(identity, serial ? std::to_string(*serial) : "",
                       Text("%u.%u", revision >> 16, revision & 0xFFFF));
    if (const Result<> facts = CheckFacts(facts_, settings_); facts) {
      Accept(now);
    } else {
      Refuse(facts.error().text, now);
    }
  }
  void Accept(MonoNs now) {
    stage_ = Stage::kRunning;
    const auto serial = facts_.Get(kSerial);
    const auto product = facts_.Get(kProduct);
    const auto offset = facts_.Get(kOffset);
    const bool moved = offset && last_offset_ && offset != last_offset_;
    const bool same = serial == last_serial_ && product == last_product_ && !moved && refusal_.empty();
    if (std::exchange(identified_before_, true) && !same) output_.OnJump();
    last_serial_ = serial;
    last_product_ = product;
    last_offset_ = offset;
    if (!std::exchange(refusal_, "").empty()) {
      output_.OnAlarm(kWrongEncoder, AlarmState::kAbsent, now);
    }
    alarms_.Begin(facts_, now);
    const auto timer = facts_.Get(kTpdoTimer);
    const bool differs = settings_.mode == Mode::kCyclic && !facts_.synchronous() && timer && *timer != 0 &&
                         *timer * kMillisecond != settings_.period;
    output_.OnAlarm(kPeriodDiffers, differs ? AlarmState::kLive : AlarmState::kAbsent, now);
    monitor_.Arrived(now);
    operate_by_ = now + kOperateWithin;
    diagnostics_at_ = now + settings_.diagnostics;
    warnings_next_ = !Answers(kAlarms);
  }
  void Refuse(const std::string& reason, MonoNs now) {
    stage_ = Stage::kRefused;
    recheck_at_ = now + kRecheck;
    if (reason == refusal_) return;
    refusal_ = reason;
    output_.OnRefused(reason);
    output_.OnAlarm(kWrongEncoder, AlarmState::kLive, now);
  }
  void ShowNmtState(MonoNs now) {
    const bool needed = settings_.mode != Mode::kPolled && running();
    const bool seen = watch_.state() && *watch_.state() != NmtState::kOperational;
    const bool is = needed && seen && now >= operate_by_;
    if (is == not_operational_) return;
    not_operational_ = is;
    output_.OnAlarm(kNotOperational, is ? AlarmState::kLive : AlarmState::kAbsent, now);
  }
  [[nodiscard]] std::optional<NmtCommand> NeededCommand() const {
    if (!settings_.nmt_start) return std::nullopt;
    const bool operational = watch_.state() == NmtState::kOperational;
    if (running() && settings_.mode != Mode::kPolled && !operational) return NmtCommand::kStart;
    // A stopped node answers no SDO (7.3.2.2.4); an unknown one is not made operational.
    const bool silent = client_.silent_in_a_row() >= kGone && !watch_.state();
    const bool stopped = watch_.state() == NmtState::kStopped;
    if (!running() && (stopped || silent)) return NmtCommand::kEnterPreOperational;
    return std::nullopt;
  }
  // Returns whether the node sends positions, as far as is known.
  [[nodiscard]] bool Operates() const {
    return running() && watch_.state().value_or(NmtState::kOperational) == NmtState::kOperational;
  }
  // Returns whether it does so by itself.
  [[nodiscard]] bool Streams() const { return settings_.mode == Mode::kCyclic && Operates(); }
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
