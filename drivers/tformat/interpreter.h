#pragma once

#include <cstdint>
#include <optional>

#include "core/device/device.h"
#include "drivers/tformat/answer.h"
#include "drivers/tformat/identity_check.h"
#include "drivers/tformat/settings.h"

namespace axlecast::tformat {

// What the encoder says, towards the outside: samples, errors by kind, alarms, identity, the trust in its turns,
// and where its position jumps because of a reset. All of it follows from the events alone, whoever made the
// requests and why; so a recorded sequence of events gives the same again.
class Interpreter {
 public:
  Interpreter(const TFormatSettings& settings, const Expectation& expected, MonoNs character, DeviceOutput& output);

  void OnLinkUp(MonoNs now);
  // `sent`: what was asked and is not answered.
  void OnLinkDown(std::optional<DataId> sent);
  void OnStray(const Event& event);
  // An exchange is over: kReply or kTimeout.
  Answer OnExchange(const Event& event);

  // Good replies come. Not before the first one after the link came up, and no more after two requests in a row
  // brought not a single byte: then another encoder may be there, or the same one after a power-off.
  [[nodiscard]] bool answering() const { return answering_; }
  [[nodiscard]] const IdentityCheck& identity() const { return identity_; }
  // ALMC of the last reply to ID 3, while the encoder answers.
  [[nodiscard]] std::optional<std::uint8_t> alarms() const { return alarms_; }
  // ALMC is out of date (the status field says so: TS5669 spec 6.3.2) or needs confirmation: ID 3 at once.
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
  void JudgeTurns(std::uint8_t alarms);
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

}  // namespace axlecast::tformat
