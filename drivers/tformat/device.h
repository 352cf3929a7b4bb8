#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/config/machine_config.h"
#include "core/device/device.h"
#include "drivers/kit/command_runner.h"
#include "drivers/tformat/codec.h"
#include "drivers/tformat/operations.h"
#include "drivers/tformat/settings.h"

namespace axlecast::tformat {

// Checks that the encoder that answers is the configured one: the model by its ENID and, if the configuration names a
// tag, the unit by bytes of its user EEPROM. No position is published before the encoder is accepted. An encoder is
// refused after three consecutive wrong readings, because one can be damaged.
class IdentityCheck {
 public:
  static constexpr int kConfirmations = 3;
  // A refused tag is read again after this time, because the right encoder may have been connected.
  static constexpr MonoNs kRecheck = 1 * kSecond;

  IdentityCheck(const TFormatSettings& settings, DeviceOutput& output);

  // Another encoder may be connected now: everything must be read again.
  void Forget();
  void OnEncoderId(std::uint8_t encoder_id, MonoNs now);
  // A cell as an ID D reply shows it.
  void OnCell(std::uint8_t address, std::uint8_t data, MonoNs now);

  [[nodiscard]] bool accepted() const { return state_ == State::kAccepted; }
  [[nodiscard]] bool refused() const { return refused_; }
  // Returns the cell that must be read next for the tag; nothing if no cell is needed.
  [[nodiscard]] std::optional<std::uint8_t> WantedCell() const;

 private:
  enum class State : std::uint8_t { kUnknown, kReadingTag, kAccepted, kWrongModel, kWrongUnit };

  void Identify(std::uint8_t encoder_id);
  void CheckTag(MonoNs now);
  void ReadTag();
  void Accept(MonoNs now);
  void Refuse(std::string_view reason, MonoNs now);

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
  Interpreter(const TFormatSettings& settings, const Expectation& expected, MonoNs character, DeviceOutput& output);

  void OnLinkUp(MonoNs now);
  // `sent`: the request that has no answer yet.
  void OnLinkDown(std::optional<DataId> sent);
  void OnStray(const Event& event);
  // An exchange has ended: kReply or kTimeout.
  Answer OnExchange(const Event& event);

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
  [[nodiscard]] bool InStandby(MonoNs now) const;
  void ReportStarting();
  void Forget();
  [[nodiscard]] Answer RefuseContradiction(Answer answer);
  void OnFailure(const Answer& answer, const Event& event);
  void TrackResets(const Answer& answer);
  void TrackEepromWrite(const Answer& answer);
  void OnAll(const Reply& reply, MonoNs now);
  void FinishReset(const Reply& reply);
  void ReportAlarms(std::uint8_t alarms, MonoNs now);
  void UpdateTrustInTurns(std::uint8_t alarms);
  void CompareStatus(const Answer& answer);
  [[nodiscard]] Sample MakeSample(const Reply& reply, const Interval& at) const;
  void TrackCommunicationAlarm(const Answer& answer, MonoNs now);

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
//   contains the position. If ID 0 may not be requested either, or the encoder is silent, ID 2 tests whether it answers.
//   After the start of the process, the test reads an EEPROM cell that differs from start to start.
// - Nothing is transmitted while the encoder may transmit: after an unclear exchange, the line must be idle first.
// - A reading that failed is repeated once at once, then in the next slot.
class TFormatDevice final : public CommandDevice<Procedure> {
 public:
  TFormatDevice(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output);

  [[nodiscard]] Step Next(const BusSlot& slot) const override;
  void OnStarted(const Step& step, MonoNs now) override;
  void On(const Event& event) override;
  void Begin(const DriverCommand& command, MonoNs now) override;
  [[nodiscard]] bool Cancel(const CommandId& id, MonoNs now) override;

 private:
  [[nodiscard]] Step PlannedStep(const BusSlot& slot) const;
  [[nodiscard]] Step OtherStep(const BusSlot& slot) const;
  [[nodiscard]] Step WatchStep(const BusSlot& slot) const;
  [[nodiscard]] Step LiveStep(const BusSlot& slot) const;
  [[nodiscard]] DataId PlannedId() const;
  [[nodiscard]] Result<std::unique_ptr<Procedure>> MakeProcedure(const DriverCommand& command,
                                                                 MonoNs now) const override;
  [[nodiscard]] Result<> CheckState(const DriverCommand& command, MonoNs now) const override;
  void OnExchange(const Event& event);
  void OnLiveAnswer(const Answer& answer, MonoNs end);
  void OnLinkUp(MonoNs now);
  void OnLinkDown();
  void Report(const std::optional<Outcome>& outcome);

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

}  // namespace axlecast::tformat
