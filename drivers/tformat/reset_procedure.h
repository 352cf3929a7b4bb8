#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/base/time.h"
#include "core/device/device.h"
#include "drivers/tformat/codec.h"
#include "drivers/tformat/operations.h"
#include "drivers/tformat/settings.h"

namespace axlecast::tformat {

// TS5669 spec 9: "Transmit 10 times in one sequence with the interval of 40 ms or more".
inline constexpr int kResetTimes = 10;
// From the end of one request's reply to the next request: the encoder's own 40 ms and a margin for both clocks.
// The reply proves that its request has arrived, whatever the adapter's delays.
inline constexpr MonoNs kResetInterval = 41 * kMillisecond;
// Requests of one sequence that the encoder may answer with a communication alarm, which means that it did not understand
// them. Each is sent again (spec 6.3.2 (4)).
inline constexpr int kMaxAlarmedRequests = 5;
// From the last request to its effect: "maximum 18 ms" (spec 9, for the zero; 8.1, for an EEPROM cell), with a
// margin.
inline constexpr MonoNs kWriteTime = 20 * kMillisecond;

[[nodiscard]] constexpr bool IsReset(DataId id) {
  return id == DataId::kClearErrors || id == DataId::kZeroSingleTurn || id == DataId::kResetTurnsAndErrors;
}

// The multi-turn counter is 0, or the adjacent turn while the shaft rests at the border between two turns.
[[nodiscard]] bool TurnsAreReset(const Reply& all, const TFormatSettings& settings);
// The single-turn position is 0 within the maker's 0.35 degrees.
[[nodiscard]] bool IsZero(const Reply& all, const TFormatSettings& settings);

// Ten requests of one reset, 41 ms apart, and the reading that shows their effect (TS5669 spec 9). It begins with a
// reading by ID 3, which shows the state before and ends a sequence that another process left unfinished. The two resets
// that move the position require a shaft at rest before each of the ten requests.
//
// A request that is answered with a communication alarm is sent again after the same interval (spec 6.3.2 (4)), a few
// times, as long as the shaft rests. It is not counted among the ten. Whether the encoder counts it is not documented:
// from ten requests on, alarmed ones included, a reading decides what was done.
//
// Any other request without a good reply, or a shaft that moves, ends the sequence before the tenth request: the encoder
// then does nothing. The driver's next request is ID 3, so that the sequence is never completed.
class ResetProcedure final : public Procedure {
 public:
  // `id`: kClearErrors, kZeroSingleTurn or kResetTurnsAndErrors.
  ResetProcedure(DataId id, const TFormatSettings& settings, const DeviceOutput& output);

  [[nodiscard]] Step Next(MonoNs now) const override;
  std::optional<Outcome> OnStarted(Bytes request, MonoNs now) override;
  std::optional<Outcome> OnAnswer(const Answer& answer, MonoNs end) override;
  [[nodiscard]] Outcome OnLinkLost() const override;
  [[nodiscard]] bool exclusive() const override { return stage_ != Stage::kReadBefore; }
  [[nodiscard]] bool touched() const override { return sent_ + alarmed_ > 0 || in_flight_; }

 private:
  enum class Stage : std::uint8_t { kReadBefore, kSend, kVerify };

  [[nodiscard]] bool NeedsStandstill() const { return id_ != DataId::kClearErrors; }
  [[nodiscard]] bool MayGoOn(MonoNs now) const;
  std::optional<Outcome> OnBefore(const Answer& answer);
  std::optional<Outcome> OnSent(const Answer& answer, MonoNs end);
  [[nodiscard]] std::optional<Outcome> Ended(const Answer& answer) const;
  void VerifyAt(MonoNs due);
  // Returns whether enough requests were sent that the encoder may have executed the reset, however it counts them.
  [[nodiscard]] bool MayBeDone() const { return sent_ + alarmed_ >= kResetTimes; }
  std::optional<Outcome> OnVerified(const Answer& answer);
  [[nodiscard]] Outcome NotAtRest(const Motion& motion) const;
  [[nodiscard]] Outcome Moved(std::int64_t counts) const;
  [[nodiscard]] Outcome Unanswered(const Answer& answer) const;
  [[nodiscard]] Outcome Evaluate(const Reply& after) const;
  [[nodiscard]] Outcome EvaluateZero(const Reply& after) const;
  [[nodiscard]] Outcome EvaluateTurns(const Reply& after) const;
  [[nodiscard]] Outcome EvaluateErrors(const Reply& after) const;
  [[nodiscard]] std::uint8_t StillLatched(const Reply& after) const;
  [[nodiscard]] std::string Lost() const;
  [[nodiscard]] Outcome Fitting(const std::string& text) const;
  [[nodiscard]] bool SameBefore() const;

  const DataId id_;
  const TFormatSettings& settings_;
  const DeviceOutput& output_;
  Stage stage_ = Stage::kReadBefore;
  MonoNs due_ = 0;
  int sent_ = 0;     // and not answered with a communication alarm
  int alarmed_ = 0;  // answered with one
  bool in_flight_ = false;
  bool tenth_lost_ = false;
  int failed_reads_ = 0;
  Reply before_;
};

}  // namespace axlecast::tformat
