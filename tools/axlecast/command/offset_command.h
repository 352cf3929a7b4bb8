#pragma once

#include <axlecast/device_info_t.hpp>
#include <axlecast/position_t.hpp>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "core/base/result.h"

namespace axlecast {

// Averages the readings of an axis at rest, and computes the datum with which they read a given value.
class OffsetCapture {
 public:
  // Maximum speed at rest. A held shaft can seem to creep.
  static constexpr double kMaxSpeedRpm = 0.5;
  // Maximum spread at rest, in turns, for devices that report no speed.
  static constexpr double kMaxSpreadTurns = 1e-3;

  // Averages `samples` valid readings, at least 1.
  explicit OffsetCapture(std::int64_t samples) : samples_(samples) {}

  void On(const position_t& reading);
  void On(const device_info_t& info);

  // Fails if the axis turns, its datum changed or its driver restarted.
  [[nodiscard]] const Result<>& state() const { return state_; }
  [[nodiscard]] bool done() const { return !state_ || (count_ >= samples_ && info_.has_value()); }
  [[nodiscard]] std::int64_t count() const { return count_; }

  // Valid if done() and not failed:
  [[nodiscard]] double counts() const;  // mean, with direction, without datum
  [[nodiscard]] std::int64_t spread() const { return highest_ - lowest_; }
  // Returns the datum with which the axis reads `value`.
  [[nodiscard]] std::int64_t Datum(double value) const;

  [[nodiscard]] std::string Text(const std::string& device, double value) const;
  [[nodiscard]] nlohmann::ordered_json Json(const std::string& device, double value) const;

 private:
  [[nodiscard]] Result<> Check(const position_t& reading) const;

  const std::int64_t samples_;
  std::optional<device_info_t> info_;
  std::optional<position_t> first_;
  std::int64_t count_ = 0;
  double sum_ = 0;  // of the counts' differences from the first
  std::int64_t lowest_ = 0;
  std::int64_t highest_ = 0;
  Result<> state_;
};

}  // namespace axlecast
