#pragma once

#include <optional>
#include <string>

#include "drivers/tsubaki_sc/block_reader.h"

namespace axlecast::tsubaki_sc {

// clear_trip_count and start_motor: looks at the status and the stop coil, sets its coil, looks again. The coil goes
// off by itself (guideline 8), so only what it does can be read. Written once: what became of it, the reading tells.
class CoilOrder final : public Procedure {
 public:
  enum class Kind : std::uint8_t { kClearTripCount, kStartMotor };

  CoilOrder(Kind kind, const Requests& requests);

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
