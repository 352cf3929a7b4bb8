#include "drivers/kit/simulation/shaft_motion.h"

#include <array>
#include <cmath>
#include <vector>

#include "drivers/kit/simulation/quantity_text.h"

namespace axlecast {
namespace {

constexpr double kMaxDegrees = 1e8;
constexpr double kMaxRpm = 20'000;
constexpr double kMaxAcceleration = 200'000;  // rad/s^2

std::vector<std::string_view> Split(std::string_view text) {
  std::vector<std::string_view> parts;
  while (true) {
    const std::size_t comma = text.find(',');
    parts.push_back(text.substr(0, comma));
    if (comma == std::string_view::npos) return parts;
    text.remove_prefix(comma + 1);
    while (text.starts_with(' ')) text.remove_prefix(1);
  }
}

std::string OrderSine(Shaft& shaft, const std::vector<std::string_view>& parts, MonoNs now) {
  double amplitude_deg = 0;
  double period_s = 0;
  if (std::string p = ReadNumber(parts[0], 0, 1e6, "deg", amplitude_deg); !p.empty()) return p;
  if (std::string p = ReadNumber(parts[1], 0.001, 1e6, "s", period_s); !p.empty()) return p;
  const ShaftAngle amplitude = AngleFromDegrees(amplitude_deg);
  const MonoNs period = std::llround(period_s * 1e9);
  const double peak = Shaft::SwingAcceleration(amplitude, period);
  if (peak > shaft.acceleration_rad_s2()) {
    return "this sine needs " + NumberText(peak) + " rad/s^2, more than accel_rad_s2 (" +
           NumberText(shaft.acceleration_rad_s2()) + "): make it slower or smaller, or set accel_rad_s2 first";
  }
  shaft.Swing(amplitude, period, now);
  return {};
}

std::string OrderShuttle(Shaft& shaft, const std::vector<std::string_view>& parts, MonoNs now) {
  double from = 0;
  double to = 0;
  double rpm = 0;
  if (std::string p = ReadNumber(parts[0], -kMaxDegrees, kMaxDegrees, "deg", from); !p.empty()) return p;
  if (std::string p = ReadNumber(parts[1], -kMaxDegrees, kMaxDegrees, "deg", to); !p.empty()) return p;
  if (std::string p = ReadNumber(parts[2], 0.001, kMaxRpm, "rpm", rpm); !p.empty()) return p;
  shaft.Shuttle(AngleFromDegrees(from), AngleFromDegrees(to), rpm, now);
  return {};
}

std::string OrderMove(Shaft& shaft, const std::vector<std::string_view>& parts, MonoNs now) {
  double to = 0;
  double rpm = 0;
  if (std::string p = ReadNumber(parts[0], -kMaxDegrees, kMaxDegrees, "deg", to); !p.empty()) return p;
  if (std::string p = ReadNumber(parts[1], 0.001, kMaxRpm, "rpm", rpm); !p.empty()) return p;
  shaft.MoveTo(AngleFromDegrees(to), rpm, now);
  return {};
}

std::string Begin(Shaft& shaft, std::string_view text, MonoNs now) {
  if (text == "stop") {
    shaft.Run(0, now);
    return {};
  }
  const std::size_t colon = text.find(':');
  const std::string_view name = text.substr(0, colon);
  const std::vector<std::string_view> parts =
      colon == std::string_view::npos ? std::vector<std::string_view>() : Split(text.substr(colon + 1));
  if (name == "sine" && parts.size() == 2) return OrderSine(shaft, parts, now);
  if (name == "shuttle" && parts.size() == 3) return OrderShuttle(shaft, parts, now);
  if (name == "move" && parts.size() == 2) return OrderMove(shaft, parts, now);
  return "'" + std::string(text) +
         "' is none of stop, sine:AMPLITUDE_DEG,PERIOD_S, shuttle:FROM_DEG,TO_DEG,RPM, move:TO_DEG,RPM";
}

}  // namespace

std::string OrderMotion(Shaft& shaft, std::string_view text, MonoNs now, std::string& motion) {
  std::string problem = Begin(shaft, text, now);
  if (problem.empty()) motion = text;
  return problem;
}

std::string OrderSpeed(Shaft& shaft, std::string_view text, MonoNs now, std::string& motion) {
  double rpm = 0;
  std::string problem = ReadNumber(text, -kMaxRpm, kMaxRpm, "rpm", rpm);
  if (!problem.empty()) return problem;
  shaft.Run(rpm, now);
  motion = "constant";
  return {};
}

std::string OrderAcceleration(Shaft& shaft, std::string_view text) {
  double rad_s2 = 0;
  std::string problem = ReadNumber(text, 1, kMaxAcceleration, "rad/s^2", rad_s2);
  if (problem.empty()) shaft.SetAcceleration(rad_s2);
  return problem;
}

}  // namespace axlecast
