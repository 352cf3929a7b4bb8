#pragma once

#include <axlecast/device_info_t.hpp>
#include <axlecast/position_t.hpp>
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

namespace axlecast {

// The mean of an axis's readings at rest, and the datum that makes them read a value. Pure.
class OffsetCapture {
 public:
  // Above this it turns; below, a shaft that is held may still seem to creep.
  static constexpr double kMaxSpeedRpm = 0.5;
  // A turn of the shaft has this share of spread at most, where the device tells no speed.
  static constexpr double kMaxSpreadTurns = 1e-3;

  // Takes `samples` valid readings, >= 1.
  explicit OffsetCapture(std::int64_t samples) : samples_(samples) {}

  void On(const position_t& reading);
  void On(const device_info_t& info);

  // Why it cannot be: it turns (with the speed), the datum changed, the driver restarted. Empty while it can.
  [[nodiscard]] const std::string& problem() const { return problem_; }
  [[nodiscard]] bool done() const { return !problem_.empty() || (count_ >= samples_ && info_.has_value()); }
  [[nodiscard]] std::int64_t count() const { return count_; }

  // When done without a problem:
  [[nodiscard]] double counts() const;  // mean, after direction, before any datum
  [[nodiscard]] std::int64_t spread() const { return highest_ - lowest_; }
  // The datum with which it reads `value`.
  [[nodiscard]] std::int64_t Datum(double value) const;

  [[nodiscard]] std::string Text(const std::string& device, double value) const;
  [[nodiscard]] nlohmann::ordered_json Json(const std::string& device, double value) const;

 private:
  void Check(const position_t& reading);

  const std::int64_t samples_;
  std::optional<device_info_t> info_;
  std::optional<position_t> first_;
  std::int64_t count_ = 0;
  double sum_ = 0;  // of the counts' differences from the first
  std::int64_t lowest_ = 0;
  std::int64_t highest_ = 0;
  std::string problem_;
};

}  // namespace axlecast
