#pragma once

#include <benchmark/benchmark.h>

#include <cstdint>
#include <string_view>

#include "core/device/device.h"

namespace axlecast {

// Receives the output of a device and discards it.
class NullOutput final : public DeviceOutput {
 public:
  void OnSample(const Sample& sample) override {
    benchmark::DoNotOptimize(sample.counts);
    ++samples;
  }
  void OnError(ErrorKind, Interval) override {}
  void OnAlarm(const AlarmSpec&, AlarmState, MonoNs) override {}
  void OnMotor(const MotorReading&) override {}
  void OnTrip(const TripRecord&) override {}
  void OnIdentity(std::int64_t, std::string_view, std::string_view) override {}
  void OnStarting(std::string_view) override {}
  void OnRefused(std::string_view) override {}
  void OnNonVolatileWrite() override {}
  void OnReferenceLost() override {}
  void OnReferenceRestored() override {}
  void OnJump() override {}
  void OnDatumChanging(bool) override {}
  void OnOutcome(const CommandId&, const Outcome&) override {}
  [[nodiscard]] Motion MotionAt(MonoNs) const override { return {}; }

  std::int64_t samples = 0;
};

}  // namespace axlecast
