#pragma once

#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/device/device.h"

namespace axlecast {

// Keeps what a device hands to the outside.
class RecordingOutput : public DeviceOutput {
 public:
  void OnSample(const Sample& sample) override { samples.push_back(sample); }
  void OnMotor(const MotorReading& reading) override { motors.push_back(reading); }
  void OnTrip(const TripRecord& record) override { trips.push_back(record); }
  void OnMotorLimits(const MotorLimits& its) override { limits.push_back(its); }
  void OnProductCode(std::string_view code) override { product_code = code; }
  void OnError(ErrorKind kind, Interval at) override { errors.emplace_back(kind, at); }
  void OnAlarm(const AlarmSpec& alarm, AlarmState state, MonoNs) override {
    alarms.emplace_back(alarm.code, state);
    alarm_specs.insert_or_assign(alarm.code, alarm);
  }
  void OnIdentity(std::int64_t its, std::string_view, std::string_view) override { identity = its; }
  void OnStarting(std::string_view reason) override { starting.emplace_back(reason); }
  void OnRefused(std::string_view reason) override { refused.emplace_back(reason); }
  void OnNonVolatileWrite() override { ++nv_writes; }
  void OnReferenceLost() override { reference_lost = true; }
  void OnReferenceRestored() override { reference_lost = false; }
  void OnJump() override { ++jumps; }
  void OnDatumChanging(bool changing) override { datum_changing = changing; }
  void OnOutcome(const CommandId& id, const Outcome& outcome) override { outcomes.emplace_back(id, outcome); }
  [[nodiscard]] Motion MotionAt(MonoNs) const override { return motion; }

  Motion motion;  // what MotionAt answers
  std::vector<Sample> samples;
  std::vector<MotorReading> motors;
  std::vector<TripRecord> trips;
  std::vector<MotorLimits> limits;
  std::string product_code;
  std::vector<std::pair<ErrorKind, Interval>> errors;
  std::vector<std::pair<std::int32_t, AlarmState>> alarms;
  std::map<std::int32_t, AlarmSpec> alarm_specs;  // of every alarm that was reported, by code
  std::vector<std::string> starting;
  std::vector<std::string> refused;
  std::vector<std::pair<CommandId, Outcome>> outcomes;
  std::int64_t identity = -1;
  int nv_writes = 0;
  int jumps = 0;
  bool reference_lost = false;
  bool datum_changing = false;
};

}  // namespace axlecast
