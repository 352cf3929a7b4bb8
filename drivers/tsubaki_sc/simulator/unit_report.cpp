#include "drivers/tsubaki_sc/simulator/unit_report.h"

#include <array>
#include <string_view>

namespace axlecast::tsubaki_sc::simulator {
namespace {

constexpr std::array<std::string_view, 7> kInstantaneous = {"voltage", "current", "power",  "temperature",
                                                            "accel_x", "accel_y", "accel_z"};

std::string MotorText(const ScUnit& unit) {
  if (unit.motor.running()) return "running";
  return unit.motor_status() != 0 ? "tripped" : "stopped";
}

}  // namespace

void AddReport(const ScUnit& unit, std::vector<std::pair<std::string, std::string>>& list) {
  const auto count = [&list](std::string_view name, std::int64_t value) {
    list.emplace_back(name, std::to_string(value));
  };
  std::uint16_t address = 100;
  for (const std::string_view name : kInstantaneous) {
    const std::uint16_t value = unit.InputRegister(address);
    const bool is_signed = address >= 100 + kTemperatureIndex;
    count("register_" + std::string(name), is_signed ? static_cast<std::int16_t>(value) : value);
    ++address;
  }
  list.emplace_back("motor", MotorText(unit));
  list.emplace_back("motor_status", CauseText(unit.motor_status()));
  count("trip_count", unit.trip_count());
  for (std::size_t log = 0; log < TripLogs::kLogs; ++log) {
    list.emplace_back("trip_factor_" + std::to_string(log + 1), CauseText(unit.logs().factor(log)));
  }
  count("stop_coil", unit.Coil(kCoilStop) ? 1 : 0);
  count("logged_in", unit.access.logged_in() ? 1 : 0);
  count("starts", unit.effects.starts);
  count("stops", unit.effects.stops);
  count("logins", unit.effects.logins);
  count("logouts", unit.effects.logouts);
  count("wrong_passwords", unit.effects.wrong_passwords);
  count("password_changes", unit.effects.password_changes);
  count("parameter_writes", unit.effects.parameter_writes);
  count("trip_count_clears", unit.effects.trip_count_clears);
}

}  // namespace axlecast::tsubaki_sc::simulator
