#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "core/base/time.h"
#include "drivers/tsubaki_sc/simulator/trip_log.h"

namespace axlecast::tsubaki_sc::simulator {

// Bits of the motor status and of the trip factors, guideline 10, note 1. The first four in the order of the SET
// parameters 0-3 and 5-8.
inline constexpr std::uint16_t kUpperA = 1U << 0U;
inline constexpr std::uint16_t kUpperB = 1U << 1U;
inline constexpr std::uint16_t kLowerA = 1U << 2U;
inline constexpr std::uint16_t kLowerB = 1U << 3U;
inline constexpr std::uint16_t kOverheat = 1U << 5U;
inline constexpr std::uint16_t kExcessiveShock = 1U << 6U;

struct Cause {
  std::string_view name;
  std::uint16_t bit;
};
inline constexpr std::array<Cause, 6> kCauses = {{{"power_upper_a", kUpperA},
                                                  {"power_upper_b", kUpperB},
                                                  {"power_lower_a", kLowerA},
                                                  {"power_lower_b", kLowerB},
                                                  {"overheat", kOverheat},
                                                  {"excessive_shock", kExcessiveShock}}};
// "power_upper_a power_upper_b", or "none".
[[nodiscard]] std::string CauseText(std::uint16_t bits);

// What the motor is judged by, as the registers hold it.
struct Limits {
  std::array<std::uint16_t, 4> power{};       // 0.1 W: upper A, upper B, lower A, lower B; 0: not judged
  std::uint16_t start_time = 1;               // 0.1 s
  std::array<std::uint16_t, 4> shock_time{};  // 0.1 s, of each power limit
  std::uint16_t overheat = 0;                 // 0.1 C; 0: not judged
  std::uint16_t excessive_shock = 0;          // 0.01 m/s^2; 0: not judged
};

// Decides when a running motor trips. What the guideline leaves open: a value trips beyond its limit, not at it; power
// is not judged during the start time; beyond a power limit for its shock time without a break trips; the largest of
// the three axes is judged.
class Protection {
 public:
  // Of a motor that has started.
  void Begin(MonoNs now);
  // The causes to trip now, 0 for none.
  [[nodiscard]] std::uint16_t Judge(const Record& record, const Limits& limits, MonoNs now);

 private:
  [[nodiscard]] std::uint16_t JudgePower(std::uint16_t power, const Limits& limits, MonoNs now);

  MonoNs begun_ = 0;
  std::array<MonoNs, 4> beyond_since_{};
};

}  // namespace axlecast::tsubaki_sc::simulator
