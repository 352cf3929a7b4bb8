#include "drivers/cia406/interpreter.h"

#include <algorithm>
#include <utility>

#include "core/device/operation.h"
#include "drivers/protocol/canopen/canopen.h"

namespace axlecast::cia406 {
namespace {

using Kind = SdoResult::Kind;

constexpr int kPeriodsToSilence = 3;
// Transfers, or SYNCs, in a row without an answer after which the node counts as gone.
constexpr int kGone = 2;
constexpr int kMaxMissedSyncs = 3;
constexpr MonoNs kRetry = 500 * kMillisecond;
constexpr MonoNs kRecheck = 2 * kSecond;
constexpr MonoNs kCommandPause = 1 * kSecond;
// From the command to the heartbeat that shows its effect, at the slowest usual producer time.
constexpr MonoNs kOperateWithin = 3 * kSecond;
constexpr std::size_t kPositionAndStatus = 6;

}  // namespace

// ---- positions ----

void PositionReader::OnLinkUp(MonoNs now) {
  sync_from_.reset();
  last_own_sync_ = now;
  doubt_from_ = now - late_;  // an earlier process may have sent SYNC
}

void PositionReader::OnSync(MonoNs from, bool own) {
  // The TPDO of the SYNC before has not come.
  if (own && sync_from_ && own_sync_ && !doubt_from_) doubt_from_ = sync_from_;
  if (own) last_own_sync_ = from;
  sync_from_ = from;
  own_sync_ = own;
}

void PositionReader::OnSdoAnswered(MonoNs sent) {
  const MonoNs answered = sent - settings_.processing;
  if (!doubt_from_ || *doubt_from_ > answered) return;
  doubt_from_ = answered;
  if (last_own_sync_ <= answered) doubt_from_.reset();
}

void PositionReader::OnTpdo(Bytes data, Interval received, bool synchronous, const NodeAlarms& alarms) {
  const Interval at = SampledAt(received, data.size(), synchronous);
  if (data.size() < kPositionSize) return output_.OnError(ErrorKind::kShort, received);
  Publish(LittleEndian(data, 0, kPositionSize), at, alarms);
}

// A position was sampled at most `processing` before the first bit of its frame. In a frame that follows a SYNC, it was
// sampled after the SYNC.
Interval PositionReader::SampledAt(Interval received, std::size_t size, bool synchronous) {
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

void PositionReader::OnAnswer(const SdoResult& result, const NodeAlarms& alarms) {
  Interval at{result.sent.first + time_.Shortest(kSdoSize), result.received.last - time_.Shortest(kSdoSize)};
  at.last = std::max(at.first, at.last);
  Publish(result.value, at, alarms);
}

void PositionReader::Publish(std::uint32_t position, Interval at, const NodeAlarms& alarms) {
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

void PositionReader::OnPresetSent() {
  output_.OnNonVolatileWrite();  // some makers' encoders keep a preset at once
  effect_from_ = kNever;
  if (!std::exchange(changing_, true)) output_.OnDatumChanging(true);
}

void PositionReader::OnPresetEnded(MonoNs now) {
  if (changing_) effect_from_ = now + settings_.preset_settle;
}

void PositionReader::OnPresetRefused() {
  if (std::exchange(changing_, false)) output_.OnDatumChanging(false);
}

Interpreter::Interpreter(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output)
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

// ---- the link ----

void Interpreter::OnLinkUp(MonoNs now) {
  client_.Reset();
  positions_.OnLinkUp(now);
  watch_.Restart(now);
  last_frame_at_ = now;
  retry_at_ = now;
  command_at_ = now;
  Identify(now);
  output_.OnStarting("no answer yet from the node");
}

void Interpreter::OnLinkDown(MonoNs now) {
  positions_.OnPresetEnded(now);
  client_.Reset();
  Identify(now);
}

// ---- events ----

std::optional<SdoResult> Interpreter::Evaluate(const Event& event) {
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

void Interpreter::OnFrame(const Event& event) {
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

void Interpreter::OnOwnFrame(const Event& event) {
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

void Interpreter::OnHeartbeat(const Event& event) {
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

void Interpreter::ShowNmtState(MonoNs now) {
  const bool needed = settings_.mode != Mode::kPolled && running();
  const bool seen = watch_.state() && *watch_.state() != NmtState::kOperational;
  const bool is = needed && seen && now >= operate_by_;
  if (is == not_operational_) return;
  not_operational_ = is;
  output_.OnAlarm(kNotOperational, is ? AlarmState::kLive : AlarmState::kAbsent, now);
}

void Interpreter::OnSync(const Event& event, bool own) {
  const MonoNs now = event.received.last;
  positions_.OnSync(own ? event.received.first + time_.Shortest(0) : event.received.first - time_.Shortest(0), own);
  if (!own) {
    if (produces_sync_ && !std::exchange(second_sync_, true)) output_.OnAlarm(kSecondSync, AlarmState::kLive, now);
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

void Interpreter::OnTpdo(const Event& event) {
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

// ---- transfers ----

void Interpreter::OnResult(const SdoResult& result) {
  const MonoNs now = result.received.last;
  if (result.kind == Kind::kTimedOut) {
    output_.OnError(ErrorKind::kTimeout, {result.sent.first, now});
    retry_at_ = client_.silent_in_a_row() < kGone ? now : now + kRetry;
  } else {
    positions_.OnSdoAnswered(result.sent.first);
  }
  if (result.kind == Kind::kSegmented) output_.OnError(ErrorKind::kAbnormalReply, result.received);
  if (result.request.object == kPreset && result.request.write) {
    result.kind == Kind::kAborted ? positions_.OnPresetRefused() : positions_.OnPresetEnded(now);
  }
  facts_.On(result);
  if (running()) {
    OnDiagnostics(result);
    const bool position = result.request.object == kPosition && !result.request.write;
    if (settings_.mode != Mode::kPolled) return;
    if (position && result.kind == Kind::kAborted) output_.OnError(ErrorKind::kException, result.received);
    if (position && result.kind == Kind::kValue) positions_.OnAnswer(result, alarms_);
    if (client_.silent_in_a_row() >= kGone) Identify(now);
  } else if (stage_ == Stage::kIdentifying && facts_.complete() && !client_.fence()) {
    CheckNode(now);
  }
}

void Interpreter::OnDiagnostics(const SdoResult& result) {
  const MonoNs now = result.received.last;
  if (result.request.object == kOffset && result.kind == Kind::kValue) last_offset_ = result.value;
  const bool of_alarms = result.request.object == kAlarms;
  if (!of_alarms && result.request.object != kWarnings) return;
  if (result.kind == Kind::kValue && of_alarms) alarms_.OnAlarms(result.value, now);
  if (result.kind == Kind::kValue && !of_alarms) alarms_.OnWarnings(result.value, now);
  const bool both = Answers(kAlarms) && Answers(kWarnings);
  warnings_next_ = both ? of_alarms : Answers(kWarnings);
  if (!both || !of_alarms) diagnostics_at_ = now + settings_.diagnostics;
}

// ---- time ----

void Interpreter::OnTime(MonoNs now) {
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

MonoNs Interpreter::Due(MonoNs now) const {
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

// ---- identity ----

void Interpreter::Identify(MonoNs now) {
  facts_.Forget();
  stage_ = Stage::kIdentifying;
  sync_open_ = false;
  missed_syncs_ = 0;
  ShowNmtState(now);
}

void Interpreter::CheckNode(MonoNs now) {
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

void Interpreter::Accept(MonoNs now) {
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

void Interpreter::Refuse(const std::string& reason, MonoNs now) {
  stage_ = Stage::kRefused;
  recheck_at_ = now + kRecheck;
  if (reason == refusal_) return;
  refusal_ = reason;
  output_.OnRefused(reason);
  output_.OnAlarm(kWrongEncoder, AlarmState::kLive, now);
}

// ---- what to send next ----

bool Interpreter::Operates() const {
  return running() && watch_.state().value_or(NmtState::kOperational) == NmtState::kOperational;
}

bool Interpreter::Streams() const { return settings_.mode == Mode::kCyclic && Operates(); }

std::optional<NmtCommand> Interpreter::NeededCommand() const {
  if (!settings_.nmt_start) return std::nullopt;
  const bool operational = watch_.state() == NmtState::kOperational;
  if (running() && settings_.mode != Mode::kPolled && !operational) return NmtCommand::kStart;
  // A stopped node answers no SDO (7.3.2.2.4); an unknown one is not made operational.
  const bool silent = client_.silent_in_a_row() >= kGone && !watch_.state();
  const bool stopped = watch_.state() == NmtState::kStopped;
  if (!running() && (stopped || silent)) return NmtCommand::kEnterPreOperational;
  return std::nullopt;
}

std::optional<CanFrame> Interpreter::UrgentFrame(MonoNs now) const {
  if (client_.abort()) return client_.abort();
  const std::optional<NmtCommand> command = NeededCommand();
  if (!command || now < command_at_) return std::nullopt;
  return NmtFrame(*command, settings_.node);
}

std::optional<ObjectId> Interpreter::FirstObject(MonoNs now) const {
  if (!client_.free() || now < retry_at_) return std::nullopt;
  if (client_.fence()) return client_.fence();
  if (running() && settings_.mode == Mode::kSync && positions_.in_doubt()) return kPosition;
  return stage_ == Stage::kIdentifying ? facts_.Missing() : std::nullopt;
}

std::optional<ObjectId> Interpreter::DiagnosticObject(MonoNs now) const {
  if (!running()) return std::nullopt;
  if (!last_offset_ && Answers(kOffset)) return kOffset;  // a preset has changed it
  if (settings_.diagnostics == 0 || now < diagnostics_at_) return std::nullopt;
  if (warnings_next_) return Answers(kWarnings) ? std::optional(kWarnings) : std::nullopt;
  return kAlarms;
}

}  // namespace axlecast::cia406
