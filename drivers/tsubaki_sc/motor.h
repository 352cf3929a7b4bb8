#pragma once

#include <optional>
#include <string>

#include "drivers/tsubaki_sc/procedure.h"
#include "drivers/tsubaki_sc/readout.h"

namespace axlecast::tsubaki_sc {

// stop_motor: sets coil 100 at once, then reads it. A stop whose reply is lost, that cannot be read back, or that reads
// 0 afterwards is sent again, for 5 s: stopping twice does no harm. It does not wait until an unclear line is cleared
// up; only its reading back does.
// Not an emergency stop: it takes a bus, a program and a unit that work.
class MotorStop final : public Procedure {
 public:
  explicit MotorStop(const Requests& requests) : requests_(requests) {}

  [[nodiscard]] Exchange Next() const override;
  void OnStarted() override { sent_ = sent_ || !verifying_; }
  void OnLoggedOut() override { sent_ = writes_ > 0; }
  std::optional<Outcome> OnAnswer(const Answer& answer) override;
  std::optional<Outcome> OnFenceFailed(const Answer& answer) override;
  [[nodiscard]] Outcome GiveUp(std::int32_t reason, const std::string& cause) const override;
  [[nodiscard]] bool touched() const override { return sent_; }
  [[nodiscard]] bool unfenced() const override { return !verifying_; }
  [[nodiscard]] bool repeats() const override { return true; }

 private:
  std::optional<Outcome> OnWritten(const Answer& answer);
  std::optional<Outcome> OnCoil(const Answer& answer);

  // Sends it again, or ends when its time is over.
  std::optional<Outcome> Repeat(const Answer& answer);
  [[nodiscard]] bool IsOver(MonoNs now) const { return now - begun_at_ >= kTime; }

  static constexpr MonoNs kTime = 5 * kSecond;

  const Requests& requests_;
  bool verifying_ = false;
  bool sent_ = false;
  MonoNs begun_at_ = kNever;  // about: the end of its first exchange
  int writes_ = 0;
  int unanswered_ = 0;     // in a row
  bool seen_off_ = false;  // the coil read 0 after the last stop that was answered
};

// clear_trip_count and start_motor: reads the status and the stop coil, sets its coil, and reads again. The coil goes
// off by itself (guideline 8), so only what it does can be read. Written once: the reading shows the result.
class CoilCommand final : public Procedure {
 public:
  enum class Kind : std::uint8_t { kClearTripCount, kStartMotor };

  CoilCommand(Kind kind, const Requests& requests);

  [[nodiscard]] Exchange Next() const override;
  void OnStarted() override { sent_ = sent_ || stage_ == Stage::kWrite; }
  void OnLoggedOut() override { sent_ = stage_ == Stage::kAfter; }
  std::optional<Outcome> OnAnswer(const Answer& answer) override;
  [[nodiscard]] Outcome GiveUp(std::int32_t reason, const std::string& cause) const override;
  [[nodiscard]] bool touched() const override { return sent_; }

 private:
  enum class Stage : std::uint8_t { kBefore, kWrite, kAfter };

  std::optional<Outcome> OnRead(const Answer& answer);
  std::optional<Outcome> OnWritten(const Answer& answer);
  [[nodiscard]] Outcome Before();
  [[nodiscard]] Outcome Cleared() const;
  [[nodiscard]] Outcome Started() const;

  const Kind kind_;
  const Requests& requests_;
  BlockReader reader_;
  Stage stage_ = Stage::kBefore;
  bool sent_ = false;
  bool confirmed_ = false;  // the unit answered that it took the write
  unsigned count_before_ = 0;
  bool stopped_before_ = false;
};

}  // namespace axlecast::tsubaki_sc
