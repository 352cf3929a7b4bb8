#pragma once

#include <gtest/gtest.h>

#include <axlecast/position_t.hpp>
#include <optional>

#include "drivers/runtime/axis/axis.h"
#include "drivers/runtime/axis/test_device.h"

namespace axlecast {

// Feeds one axis with readings 1 ms apart.
class AxisTest : public testing::Test {
 protected:
  void Make() {
    axis_.emplace(device_.config);
    t_ = kSecond;
  }
  AxisReading Read(std::int64_t counts) { return Read(ReadingAt(t_, counts)); }
  AxisReading Read(Sample sample) {
    t_ += kMillisecond;
    return axis_->Take(sample);
  }
  // Two readings that begin the counting.
  AxisReading Settle(std::int64_t counts) {
    Read(counts);
    return Read(counts);
  }
  Sample SingleTurn(std::int64_t counts) {
    Sample sample = ReadingAt(t_, counts);
    sample.has_turns = false;
    sample.turns = 0;
    return sample;
  }
  // A datum set now, by somebody who stands at the axis.
  void Home(std::int64_t counts) { axis_->SetDatum({counts, 1}, t_, t_); }
  // A datum of an earlier day.
  void Restore(std::int64_t counts) { axis_->SetDatum({counts, 1}, -kSecond * 3'600, t_); }

  TestDevice device_;
  std::optional<Axis> axis_;
  MonoNs t_ = 0;
};

inline bool Has(const AxisReading& reading, std::int32_t flag) { return (reading.flags & flag) != 0; }

inline constexpr std::int32_t kUsable = 0x01 | 0x02;  // VALID, TURNS_VALID

}  // namespace axlecast
