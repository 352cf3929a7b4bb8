#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "core/config/machine_config.h"
#include "core/device/operation.h"
#include "drivers/kit/command_runner.h"
#include "drivers/tformat/codec.h"
#include "drivers/tformat/family.h"
#include "drivers/tformat/operations.h"
#include "drivers/tformat/settings.h"

namespace axlecast::tformat {

namespace {

// "Standby period at power turning-on" (TS5669 spec 5.4): "External battery existed", "No external battery".
constexpr MonoNs kStandbyWithBattery = kSecond;
constexpr MonoNs kStandbyWithoutBattery = 1'500 * kMillisecond;
// Requests in a row that bring not a single byte, after which the encoder counts as gone.
constexpr int kGone = 2;

// The error bits that SF must have beside this ALMC: ea0 is CE, ea1 is ME, BE or BA (TS5669 spec 6.3.2 (3)).
std::uint8_t StatusOf(std::uint8_t alarms) {
  const int counting = (alarms & kAlmCountingError) != 0 ? kSfCountingError : 0;
  const int turns = (alarms & kEa1Alarms) != 0 ? kSfMultiTurn : 0;
  return static_cast<std::uint8_t>(counting | turns);
}

// The error bits of SF that disagree with ALMC.
std::uint8_t Contradiction(std::uint8_t status, std::uint8_t alarms) {
  return static_cast<std::uint8_t>((status ^ StatusOf(alarms)) & (kSfCountingError | kSfMultiTurn));
}

std::uint8_t AlarmMask(const TFormatSettings& settings) {
  return settings.turns_range > 0 ? std::uint8_t{0xFF} : static_cast<std::uint8_t>(~kMultiTurnAlarms);
}

// The interval at which an encoder that does not answer is polled, however slow its slots are.
constexpr MonoNs kAskAgain = 50 * kMillisecond;
// The pause before a tag is read again that could not be read because the encoder writes (spec 8.1: 18 ms at most).
constexpr MonoNs kBusyAgain = 2 * kMillisecond;

// Consecutive requests without a single byte of reply, after which only the ENID is requested.
constexpr int kSilent = 2;

Expectation ExpectationOf(const TFormatSettings& settings, const LinkConfig& link) {
  return {.format = settings.format, .encoder_id = settings.encoder_id, .echo = link.echo};
}

MonoNs CharacterTime(const BusConfig& bus) { return bus.simulate ? 0 : bus.link.line.ShortestCharacter(); }

const TFormatSettings& Own(const DeviceConfig& device) {
  return static_cast<const TFormatSettings&>(*device.settings);
}

// Checks that the encoder that answers is the configured one: the model by its ENID and, if the configuration names a
// tag, the unit by bytes of its user EEPROM. No position is published before the encoder is accepted. An encoder is
// refused after three consecutive wrong readings, because one can be damaged.
class IdentityCheck {
 public:
  static constexpr int kConfirmations = 3;
  // A refused tag is read again after this time, because the right encoder may have been connected.
  static constexpr MonoNs kRecheck = 1 * kSecond;

  IdentityCheck(const TFormatSettings& settings, DeviceOutput& output)
      : settings_(settings), output_(output), tag_(settings.identity ? settings.identity->bytes.size() : 0) {}

  // Another encoder may be connected now: everything must be read again.
  void Forget() {
    state_ = State::kUnknown;
    wrong_ids_ = 0;
    wrong_tags_ = 0;
  }
  void OnEncoderId(std::uint8_t encoder_id, MonoNs now) {
    if (encoder_id == settings_.encoder_id) {
      wrong_ids_ = 0;
      Identify(encoder_id);
      const bool recheck = state_ == State::kWrongUnit && now - refused_at_ >= kRecheck;
      if (state_ != State::kUnknown && state_ != State::kWrongModel && !recheck) return;
      if (tag_.empty())
        Accept(now);
      else
        ReadTag();
      return;
    }
    if (encoder_id != wrong_id_) wrong_ids_ = 0;
    wrong_id_ = encoder_id;
    if (++wrong_ids_ != kConfirmations) return;
    state_ = State::kWrongModel;
    Identify(encoder_id);
    Refuse(
        Text("encoder ID 0x%02X answers, model %s has 0x%02X: check which encoder is connected, and the key model",
             unsigned{encoder_id}, settings_.model.c_str(), unsigned{settings_.encoder_id}),
        now);
  }
  // A cell as an ID D reply shows it.
  void OnCell(std::uint8_t address, std::uint8_t data, MonoNs now) {
    if (!settings_.identity || address < settings_.identity->address) return;
    const auto index = static_cast<std::size_t>(address - settings_.identity->address);
    if (index >= tag_.size()) return;
    tag_[index] = data;
    if (state_ == State::kReadingTag || state_ == State::kAccepted) CheckTag(now);
  }

  [[nodiscard]] bool accepted() const { return state_ == State::kAccepted; }
  [[nodiscard]] bool refused() const { return refused_; }
  // Returns the cell that must be read next for the tag; nothing if no cell is needed.
  [[nodiscard]] std::optional<std::uint8_t> WantedCell() const {
    if (state_ != State::kReadingTag) return std::nullopt;
    const auto missing = std::find(tag_.begin(), tag_.end(), std::nullopt);
    if (missing == tag_.end()) return std::nullopt;
    return static_cast<std::uint8_t>(settings_.identity->address + (missing - tag_.begin()));
  }

 private:
  enum class State : std::uint8_t { kUnknown, kReadingTag, kAccepted, kWrongModel, kWrongUnit };

  void Identify(std::uint8_t encoder_id) {
    if (reported_id_ != encoder_id) output_.OnIdentity(encoder_id, "", "");
    reported_id_ = encoder_id;
  }
  void CheckTag(MonoNs now) {
    std::vector<std::uint8_t> found;
    for (const auto& byte : tag_) {
      if (!byte) return;
      found.push_back(*byte);
    }
    if (found == settings_.identity->bytes) {
      wrong_tags_ = 0;
      if (state_ != State::kAccepted) Accept(now);
      return;
    }
    if (++wrong_tags_ < kConfirmations) return ReadTag();
    state_ = State::kWrongUnit;
    refused_at_ = now;
    Refuse(Text("EEPROM %u holds %s, the configured identity is %s: another unit is connected",
                unsigned{settings_.identity->address}, HexText(found).c_str(),
                HexText(settings_.identity->bytes).c_str()),
           now);
  }
  void ReadTag() {
    state_ = State::kReadingTag;
    std::fill(tag_.begin(), tag_.end(), std::nullopt);
    if (!refused_) output_.OnStarting("reading the identity tag in the encoder's EEPROM");
  }
  void Accept(MonoNs now) {
    state_ = State::kAccepted;
    output_.OnAlarm(kWrongIdentity, AlarmState::kAbsent, now);
    if (refused_) output_.OnJump();  // an encoder was exchanged
    refused_ = false;
  }
  void Refuse(std::string_view reason, MonoNs now) {
    refused_ = true;
    output_.OnRefused(reason);
    output_.OnAlarm(kWrongIdentity, AlarmState::kLive, now);
  }

  const TFormatSettings& settings_;
  DeviceOutput& output_;
  State state_ = State::kUnknown;
  bool refused_ = false;  // reported, until an encoder is accepted
  MonoNs refused_at_ = 0;
  std::uint8_t wrong_id_ = 0;
  int wrong_ids_ = 0;  // readings in a row that showed wrong_id_
  std::optional<std::uint8_t> reported_id_;
  std::vector<std::optional<std::uint8_t>> tag_;  // as read, byte by byte
  int wrong_tags_ = 0;                            // readings of the whole tag in a row
};

// Evaluates the replies of the encoder and reports samples, errors by kind, alarms, identity, whether its turns can be
// trusted, and jumps of the position by a reset. The reports depend only on the events, not on the reason for a request:
// a recorded sequence of events gives the same reports again.
class Interpreter {
 public:
  Interpreter(const TFormatSettings& settings, const Expectation& expected, MonoNs character, DeviceOutput& output)
      : settings_(settings),
        expected_(expected),
        character_(character),
        alarm_mask_(AlarmMask(settings)),
        output_(output),
        standby_(settings.turns_range > 0 ? kStandbyWithBattery : kStandbyWithoutBattery),
        identity_(settings, output) {}

  void OnLinkUp(MonoNs now) {
    link_up_ = now;
    answered_since_link_up_ = false;
    ReportStarting();
  }
  // `sent`: the request that has no answer yet.
  void OnLinkDown(std::optional<DataId> sent) {
    // The tenth request may have been under way.
    if (resets_in_a_row_ == kResetTimes - 1) reset_done_ = reset_;
    const bool zeroing = reset_done_ == DataId::kZeroSingleTurn && resets_in_a_row_ == kResetTimes - 1;
    if (sent == DataId::kEepromWrite || (zeroing && sent == reset_done_)) output_.OnNonVolatileWrite();
    resets_in_a_row_ = 0;
    silent_in_a_row_ = 0;
    Forget();
  }
  void OnStray(const Event& event) {
    if (InStandby(event.End())) return ReportStarting();
    output_.OnError(ErrorKind::kUnexpectedBytes, event.received);
  }
  // An exchange has ended: kReply or kTimeout.
  Answer OnExchange(const Event& event) {
    if (!link_up_) link_up_ = event.sent.first;
    const Answer answer = RefuseContradiction(Interpret(event, expected_));
    const MonoNs now = event.End();
    TrackResets(answer);
    TrackEepromWrite(answer);
    TrackCommunicationAlarm(answer, now);
    if (!answer.ok()) {
      OnFailure(answer, event);
      return answer;
    }
    answering_ = true;
    answered_since_link_up_ = true;
    silent_in_a_row_ = 0;
    const Reply& reply = answer.reply;
    if (answer.asked == DataId::kAll) wants_all_ = false;
    if (reply.data) identity_.OnCell(*reply.address, *reply.data, now);
    if (reply.encoder_id) identity_.OnEncoderId(*reply.encoder_id, now);
    if (identity_.refused() && reply.single_turn) {
      output_.OnError(ErrorKind::kWrongIdentity, {event.sent.first, now});
    }
    if (!identity_.accepted()) return answer;
    if (answer.asked == DataId::kAll)
      OnAll(reply, now);
    else
      CompareStatus(answer);
    if (!reply.single_turn) return answer;
    // It latched between request and reply; the exact time is not documented.
    output_.OnSample(MakeSample(reply, event.ActedWithin(event.bytes.size(), character_)));
    return answer;
  }

  // Returns whether the encoder answers: from the first good reply after the link came up, until two consecutive requests
  // brought not a single byte. Then another encoder may be connected, or the same one after a power-off.
  [[nodiscard]] bool answering() const { return answering_; }
  [[nodiscard]] const IdentityCheck& identity() const { return identity_; }
  // ALMC of the last reply to ID 3, while the encoder answers.
  [[nodiscard]] std::optional<std::uint8_t> alarms() const { return alarms_; }
  // Returns whether ID 3 must be requested at once: ALMC is out of date according to the status field (TS5669 spec
  // 6.3.2), or needs confirmation.
  [[nodiscard]] bool wants_all() const { return wants_all_; }

 private:
  [[nodiscard]] bool InStandby(MonoNs now) const {
    return !answered_since_link_up_ && link_up_ && now - *link_up_ <= standby_;
  }
  void ReportStarting() {
    output_.OnStarting(standby_ == kStandbyWithBattery
                           ? "no answer yet: after power-on the encoder takes up to 1 s"
                           : "no answer yet: after power-on the encoder takes up to 1.5 s without a battery");
  }
  void Forget() {
    answering_ = false;
    identity_.Forget();
    alarms_.reset();
    contradiction_ = 0;
    wants_all_ = false;
    known_ = 0;
    doubted_ = 0;
  }
  // The checksum misses two inverted bits of one column, for example one of the position and one of SF or ALMC. The document
  // does not state whether an encoder changes SF and ALMC in the same reply, so a contradiction that stays is the encoder's own.
  [[nodiscard]] Answer RefuseContradiction(Answer answer) {
    if (!answer.ok() || answer.asked != DataId::kAll) return answer;
    const std::uint8_t before = contradiction_;
    contradiction_ = Contradiction(*answer.reply.status, *answer.reply.alarms);
    if (contradiction_ == 0 || contradiction_ == before) return answer;
    answer.error = ErrorKind::kRange;
    answer.reply = {};
    return answer;
  }
  void OnFailure(const Answer& answer, const Event& event) {
    const MonoNs now = event.End();
    const bool silent = answer.error == ErrorKind::kTimeout;
    // Nothing drives the line during the standby, or without a battery it is undefined (spec 5.4, note 2): fragments and
    // other bytes that are no reply are no fault either. A request that was sent during the standby is not accepted,
    // even where the time for its reply ends later.
    const bool whole = answer.not_taken || answer.error == ErrorKind::kWrongIdentity;
    if (!whole && InStandby(event.sent.first)) {
      ReportStarting();
    } else {
      output_.OnError(*answer.error, {event.sent.first, now});
    }
    if (answer.error == ErrorKind::kWrongIdentity) {
      answered_since_link_up_ = true;
      answering_ = true;
      identity_.OnEncoderId(*answer.reply.encoder_id, now);
      known_ = 0;
    }
    silent_in_a_row_ = silent ? silent_in_a_row_ + 1 : 0;
    if (silent_in_a_row_ == kGone) Forget();
  }
  void TrackResets(const Answer& answer) {
    const bool reset = IsReset(answer.asked);
    if (!reset) {
      resets_in_a_row_ = 0;
      return;
    }
    resets_in_a_row_ = answer.asked == reset_ ? resets_in_a_row_ + 1 : 1;
    reset_ = answer.asked;
    if (reset_ != DataId::kClearErrors && !datum_changing_) {
      datum_changing_ = true;
      output_.OnDatumChanging(true);
    }
    if (resets_in_a_row_ < kResetTimes) return;
    resets_in_a_row_ = 0;
    reset_done_ = reset_;
    if (reset_ == DataId::kZeroSingleTurn) output_.OnNonVolatileWrite();
  }
  // A write whose reply is lost may have been taken.
  void TrackEepromWrite(const Answer& answer) {
    if (answer.asked != DataId::kEepromWrite || answer.not_taken) return;
    if (!answer.reply.busy.value_or(false)) output_.OnNonVolatileWrite();
  }
  void OnAll(const Reply& reply, MonoNs now) {
    if (datum_changing_) output_.OnDatumChanging(false);
    datum_changing_ = false;
    ReportAlarms(*reply.alarms, now);
    UpdateTrustInTurns(*reply.alarms);
    alarms_ = reply.alarms;
    FinishReset(reply);
  }
  void FinishReset(const Reply& reply) {
    if (!reset_done_) return;
    if (reset_done_ != DataId::kClearErrors) output_.OnJump();
    if (reset_done_ == DataId::kResetTurnsAndErrors && TurnsAreReset(reply, settings_) &&
        (*reply.alarms & kTurnsInDoubt) == 0) {
      doubted_ = 0;
      output_.OnReferenceRestored();
    }
    reset_done_.reset();
  }
  // A bit counts when two ID 3 replies in a row agree on it: a damaged one can pass the checksum.
  void ReportAlarms(std::uint8_t alarms, MonoNs now) {
    const auto agreed = static_cast<std::uint8_t>(alarms_ ? ~(alarms ^ *alarms_) : 0);
    wants_all_ = agreed != 0xFF;
    for (const DeviceAlarm& alarm : DeviceAlarms()) {
      if ((agreed & alarm_mask_ & alarm.bit) == 0) continue;
      const bool present = (alarms & alarm.bit) != 0;
      if (!present && (reported_ & alarm.bit) == 0 && (known_ & alarm.bit) != 0) continue;
      const AlarmState there = alarm.latched ? AlarmState::kDeviceLatched : AlarmState::kLive;
      output_.OnAlarm(alarm.spec, present ? there : AlarmState::kAbsent, now);
    }
    reported_ = static_cast<std::uint8_t>(((reported_ & ~agreed) | (alarms & agreed)) & alarm_mask_);
    known_ |= agreed;
  }
  void UpdateTrustInTurns(std::uint8_t alarms) {
    const auto doubt = static_cast<std::uint8_t>(alarms & reported_ & kTurnsInDoubt);
    if ((doubt & ~doubted_) != 0) output_.OnReferenceLost();
    doubted_ = static_cast<std::uint8_t>((doubted_ & alarms) | doubt);
  }
  // TS5669 spec 6.3.2: when ea1 shows an error, request ID 3 and look at ALMC.
  void CompareStatus(const Answer& answer) {
    if (!answer.reply.status || !alarms_) return;
    if (Contradiction(*answer.reply.status, *alarms_) != 0) wants_all_ = true;
  }
  // What only ID 3 contains applies to readings with other IDs until the next ID 3.
  [[nodiscard]] Sample MakeSample(const Reply& reply, const Interval& at) const {
    const std::uint8_t status = reply.status.value_or(0);
    const std::uint8_t raw = reply.alarms.value_or(alarms_.value_or(0));
    const auto alarms = static_cast<std::uint8_t>(raw & alarm_mask_);
    const bool counting_error = reply.alarms && (alarms & kAlmCountingError) != 0;
    Sample sample;
    sample.at = at;
    sample.counts = *reply.single_turn;
    if (reply.multi_turn && settings_.turns_range > 0) {
      sample.has_turns = true;
      sample.turns = static_cast<std::int32_t>(*reply.multi_turn);
    }
    sample.turns_trusted = (alarms & kTurnsInDoubt) == 0;
    sample.turns_wrapped = (alarms & kAlmCounterOverflow) != 0;
    sample.low_accuracy = (alarms & kAlmFullAbsolute) != 0;
    sample.error = counting_error || (status & kSfCountingError) != 0;
    sample.warning = (alarms & kAlmBatteryAlarm) != 0;
    sample.device_status = status | raw << 8;
    return sample;
  }
  void TrackCommunicationAlarm(const Answer& answer, MonoNs now) {
    const bool live = answer.error == ErrorKind::kCommunicationAlarm;
    if (!live && !(answer.ok() && communication_alarm_)) return;
    communication_alarm_ = live;
    output_.OnAlarm(kMisreadRequest, live ? AlarmState::kLive : AlarmState::kAbsent, now);
  }

  const TFormatSettings& settings_;
  const Expectation expected_;
  const MonoNs character_;
  const std::uint8_t alarm_mask_;  // of ALMC: without turns the multi-turn bits mean nothing
  DeviceOutput& output_;
  const MonoNs standby_;
  IdentityCheck identity_;

  std::optional<MonoNs> link_up_;
  bool answered_since_link_up_ = false;
  bool answering_ = false;
  int silent_in_a_row_ = 0;

  std::optional<std::uint8_t> alarms_;  // ALMC of the last ID 3 reply
  std::uint8_t contradiction_ = 0;      // SF bits that disagreed with ALMC in the last whole ID 3 reply
  std::uint8_t reported_ = 0;           // alarms that are live or latched towards the outside
  std::uint8_t known_ = 0;              // alarms whose state was reported since the encoder was accepted
  std::uint8_t doubted_ = 0;            // OS, ME, BE that have already cost the reference
  bool communication_alarm_ = false;
  bool wants_all_ = false;

  DataId reset_ = DataId::kAll;  // of the requests in a row
  int resets_in_a_row_ = 0;
  std::optional<DataId> reset_done_;  // ten were sent; the next ID 3 shows its effect
  bool datum_changing_ = false;
};

// One encoder on T-format. Selects the next request; the Interpreter evaluates the replies.
//
// - The first request is ID 3: after a start, after the link came up, after the encoder was gone, and after an unfinished
//   reset sequence. Therefore nine requests of an earlier process are never completed by a tenth.
// - While a late reply could be mistaken for the reply to a request (StaleReplyGuard), ID 0 is requested, which also
//   contains the position. Between slots, nothing is requested instead: the replacement would have no pause. If ID 0
//   may not be requested either, or the encoder is silent, ID 2 tests whether it answers.
//   After the start of the process, the test reads an EEPROM cell that differs from start to start.
// - Nothing is transmitted while the encoder may transmit: after an unclear exchange, the line must be idle first.
// - A reading that failed is repeated once at once, then in the next slot.
class TFormatDevice final : public CommandDevice<Procedure> {
 public:
  TFormatDevice(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output)
      : CommandDevice(device.settings, Operations(), output),
        settings_(Own(device)),
        interpreter_(settings_, ExpectationOf(settings_, bus.link), CharacterTime(bus), output) {}

  [[nodiscard]] Step Next(const BusSlot& slot) const override {
    const Step step = PlannedStep(slot);
    const auto* exchange = std::get_if<Exchange>(&step.action);
    const bool of_procedure = runner_.busy() && step.priority == Priority::kCommand;
    if (exchange == nullptr || slot.pending == nullptr || (of_procedure && runner_.procedure().exclusive()))
      return step;
    if (silent_ >= kSilent && !of_procedure) return WatchStep(slot);
    return slot.MaySend(*exchange) || !slot.poll_due ? step : OtherStep(slot);
  }
  void OnStarted(const Step& step, MonoNs now) override {
    runner_.ExpireIfLate(now);
    const Exchange* exchange = std::get_if<Exchange>(&step.action);
    if (exchange == nullptr) return;
    sent_ = RequestId(exchange->request);
    if (exchange->shape.fresh) fresh_cell_ = static_cast<std::uint8_t>((fresh_cell_ + 1) % kEepromCells);
    live_slot_ = runner_.busy() && step.priority == Priority::kCommand;
    runner_.OnStarted(live_slot_);
    if (live_slot_) Report(runner_.procedure().OnStarted(exchange->request, now));
  }
  void On(const Event& event) override {
    switch (event.kind) {
      case Event::Kind::kReply:
      case Event::Kind::kTimeout:
        OnExchange(event);
        break;
      case Event::Kind::kUnexpectedBytes:
      case Event::Kind::kUnsolicited:
        interpreter_.OnStray(event);
        line_unclear_ = true;
        break;
      case Event::Kind::kSilent:
        line_unclear_ = false;
        break;
      case Event::Kind::kLinkUp:
        OnLinkUp(event.End());
        break;
      case Event::Kind::kLinkDown:
        OnLinkDown();
        break;
      default:  // of other kinds of line
        break;
    }
    runner_.ExpireIfLate(event.End());
  }
  void Begin(const DriverCommand& command, MonoNs now) override {
    if (runner_.Begin(command, link_up_, now)) live_slot_ = false;
  }
  [[nodiscard]] bool Cancel(const CommandId& id, MonoNs) override {
    const bool exclusive = runner_.busy() && runner_.procedure().exclusive();
    if (!runner_.Cancel(id)) return false;
    all_first_ = all_first_ || exclusive;
    return true;
  }

 private:
  [[nodiscard]] Step PlannedStep(const BusSlot& slot) const {
    if (!link_up_) return {.action = Idle{kNever}, .priority = Priority::kLive};
    if (line_unclear_) return {.action = WaitForIdleLine{settings_.silence}, .priority = Priority::kLive};
    const Procedure* procedure = runner_.Runnable(slot.now);
    if (procedure == nullptr || (slot.reserved && !procedure->exclusive())) return LiveStep(slot);
    const Step step = procedure->Next(slot.now);
    if (procedure->exclusive()) return step;
    const bool transmits = std::holds_alternative<Exchange>(step.action);
    if (transmits && !(slot.poll_due && live_slot_)) return step;
    Step live = LiveStep(slot);
    Idle* idle = std::get_if<Idle>(&live.action);
    if (idle == nullptr) return live;
    if (transmits) return step;
    idle->until = std::min(idle->until, std::get<Idle>(step.action).until);
    return live;
  }
  // Replaces a request whose reply could be mistaken for a late one, by another request for a position if possible.
  [[nodiscard]] Step OtherStep(const BusSlot& slot) const {
    const Exchange position = Ask(DataId::kSingleTurn, settings_.timeout);
    return slot.MaySend(position) ? Step{.action = position, .priority = Priority::kLive} : WatchStep(slot);
  }
  // Tests whether the encoder answers: its ENID never changes, so that a late reply does no harm. If not even ID 1 may be
  // requested, an earlier process may have requested it: then a cell is read that this process has probably not read.
  [[nodiscard]] Step WatchStep(const BusSlot& slot) const {
    if (slot.now < watch_again_) return {.action = Idle{watch_again_}, .priority = Priority::kLive};
    Exchange watch = Ask(DataId::kEncoderId, settings_.timeout);
    if (!slot.MaySend(Ask(DataId::kMultiTurn, settings_.timeout))) {
      watch = AskCell(fresh_cell_, settings_.timeout);
      watch.shape.fresh = true;
    }
    return {.action = watch, .priority = Priority::kLive};
  }
  [[nodiscard]] Step LiveStep(const BusSlot& slot) const {
    const auto ask = [](const Exchange& exchange) { return Step{.action = exchange, .priority = Priority::kLive}; };
    if (!slot.poll_due && slot.now < not_before_) return {.action = Idle{not_before_}, .priority = Priority::kLive};
    if (all_first_ || interpreter_.wants_all()) return ask(Ask(DataId::kAll, settings_.timeout));
    if (const auto cell = interpreter_.identity().WantedCell(); cell && slot.now >= not_before_) {
      return ask(AskCell(*cell, settings_.timeout));
    }
    if (repeat_) return ask(Ask(*repeat_, settings_.timeout));
    if (!slot.poll_due) return {.action = Idle{kNever}, .priority = Priority::kLive};
    return ask(Ask(PlannedId(), settings_.timeout));
  }
  [[nodiscard]] DataId PlannedId() const {
    const bool all = settings_.plan == Plan::kAll || since_all_ + 1 >= settings_.id3_every;
    return all || !interpreter_.identity().accepted() ? DataId::kAll : DataId::kSingleTurn;
  }
  [[nodiscard]] Result<std::unique_ptr<Procedure>> MakeProcedure(const DriverCommand& command,
                                                                 MonoNs) const override {
    return tformat::MakeProcedure(command, settings_, output_);
  }
  [[nodiscard]] Result<> CheckState(const DriverCommand& command, MonoNs) const override {
    if (!interpreter_.answering())
      return DeviceOffline("the encoder does not answer: check its power and its cable");
    if (FindOperation(Operations(), command.operation)->reads_only) return {};
    if (interpreter_.identity().refused()) {
      return Failure("another encoder is connected than configured: see its alarm wrong_identity",
                     command_status_t::REASON_WRONG_IDENTITY);
    }
    if (!interpreter_.identity().accepted()) {
      return DeviceOffline("the encoder's identity is still being read, repeat");
    }
    return CheckAlarms(command.operation, interpreter_.alarms());
  }
  void OnExchange(const Event& event) {
    const Answer answer = interpreter_.OnExchange(event);
    sent_.reset();
    line_unclear_ = answer.line_unclear;
    silent_ = answer.error == ErrorKind::kTimeout ? silent_ + 1 : 0;
    const bool watched = answer.asked == DataId::kEncoderId || answer.asked == DataId::kEepromRead;
    watch_again_ = watched ? event.End() + kAskAgain : 0;
    // The reply of another model to ID 3 also shows that the request has arrived.
    const bool arrived = answer.ok() || answer.error == ErrorKind::kWrongIdentity;
    if (arrived && answer.asked == DataId::kAll) {
      all_first_ = false;
      since_all_ = 0;
    }
    if (!interpreter_.answering()) all_first_ = true;
    if (!runner_.TakeInFlight()) return OnLiveAnswer(answer, event.End());
    Report(runner_.procedure().OnAnswer(answer, event.End()));
  }
  void OnLiveAnswer(const Answer& answer, MonoNs end) {
    if (!answer.ok()) {
      const bool again = ++failures_ == 1;
      repeat_.reset();
      if (again && !IsEeprom(answer.asked)) repeat_ = answer.asked;
      not_before_ = again ? 0 : end + kAskAgain;
      return;
    }
    failures_ = 0;
    repeat_.reset();
    not_before_ = answer.reply.busy.value_or(false) ? end + kBusyAgain : 0;
    if (answer.asked == DataId::kSingleTurn) ++since_all_;
  }
  void OnLinkUp(MonoNs now) {
    link_up_ = true;
    fresh_cell_ = static_cast<std::uint8_t>(now / kMillisecond % kEepromCells);
    line_unclear_ = true;
    all_first_ = true;
    silent_ = 0;
    watch_again_ = 0;
    failures_ = 0;
    repeat_.reset();
    not_before_ = 0;
    interpreter_.OnLinkUp(now);
  }
  void OnLinkDown() {
    link_up_ = false;
    interpreter_.OnLinkDown(std::exchange(sent_, std::nullopt));
    runner_.OnLinkLost();
  }
  // A reset sequence that was broken off must not be completed by a later request.
  void Report(const std::optional<Outcome>& outcome) {
    const bool exclusive = runner_.busy() && runner_.procedure().exclusive();
    if (runner_.Report(outcome) && exclusive && outcome->state != CommandState::kSucceeded) all_first_ = true;
  }

  const TFormatSettings& settings_;
  Interpreter interpreter_;

  bool line_unclear_ = false;     // silence before the next request
  bool all_first_ = true;         // ID 3 before anything else
  int failures_ = 0;              // live exchanges in a row
  std::optional<DataId> sent_;    // under way
  std::optional<DataId> repeat_;  // of the live exchange that failed
  MonoNs not_before_ = 0;         // of a live exchange outside its slot
  int since_all_ = 0;             // readings since the last ID 3
  int silent_ = 0;                // exchanges in a row without a byte
  MonoNs watch_again_ = 0;        // of looking whether it answers
  std::uint8_t fresh_cell_ = 0;   // hardly one that an earlier process has asked for

  bool live_slot_ = false;  // the last slot was the procedure's: a live reading that is due goes first
};

}  // namespace

std::unique_ptr<Device> MakeDevice(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output) {
  return std::make_unique<TFormatDevice>(bus, device, output);
}

}  // namespace axlecast::tformat
