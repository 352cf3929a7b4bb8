#pragma once

#include <axlecast/position_t.hpp>
#include <cstdint>
#include <optional>
#include <string>

#include "core/config/machine_config.h"
#include "core/device/simulator.h"

namespace axlecast::simulation {

// The true position of a simulated shaft that turns at a constant speed or rests, and the judge of the positions that were published of
// it. Instants are CLOCK_MONOTONIC of the driver's host, which is the time of the simulator too.
class ShaftTruth {
 public:
  enum class Verdict : std::uint8_t {
    kTrue,
    kFalse,
    kNotJudged,  // its speed or its zero was being changed
  };

  // `device` and `simulator` outlive it.
  ShaftTruth(const DeviceConfig& device, const Simulator& simulator) : device_(device), simulator_(simulator) {}

  // The shaft was given another speed, or lost or got its power: it is known again from `settled` on.
  void Disturb(MonoNs settled) {
    settled_ = std::max(settled_, settled);
    known_ = false;
  }
  // Compares a published position that is valid.
  [[nodiscard]] Verdict Judge(const position_t& position, MonoNs now);
  // Why the last Judge answered kFalse.
  [[nodiscard]] const std::string& reason() const { return reason_; }

 private:
  // Where the counts, over all turns, began to be compared: within one start of the driver and one datum_epoch.
  struct Reference {
    std::int64_t boot_id = 0;
    std::int32_t datum_epoch = 0;
    std::int64_t counts = 0;
    double truth = 0;
    double tolerance = 0;  // counts: of the reading with which it began
  };

  void Calibrate(MonoNs now);
  [[nodiscard]] std::string Changes(MonoNs now) const;
  [[nodiscard]] double TotalAt(MonoNs at) const { return total_ + per_ns_ * static_cast<double>(at - at_); }
  [[nodiscard]] bool TurnIsTrue(const position_t& position, double tolerance);
  [[nodiscard]] bool CountsAreTrue(const position_t& position, double tolerance);

  const DeviceConfig& device_;
  const Simulator& simulator_;
  MonoNs settled_ = 0;
  bool known_ = false;
  MonoNs at_ = 0;        // of what follows
  double counts_ = 0;    // within the turn
  double total_ = 0;     // counts over all turns, from any origin
  double per_ns_ = 0;    // counts
  std::string changes_;  // the counters of changes of the zero
  std::optional<Reference> reference_;
  std::string reason_;
};

}  // namespace axlecast::simulation
