#include "tools/axlecast/live/table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "core/base/text.h"
#include "core/messages/enum_names.h"
#include "tools/axlecast/live/motor_text.h"

namespace axlecast {
namespace {

// Decimals that show one count, 0..6.
int DecimalsOf(const device_info_t& info) {
  const double counts = static_cast<double>(info.counts_per_turn) * static_cast<double>(info.ratio_den);
  const double count = counts > 0 ? info.per_turn * static_cast<double>(info.ratio_num) / counts : 0;
  if (!(std::abs(count) > 0)) return 3;
  return static_cast<int>(std::clamp(std::ceil(-std::log10(std::abs(count))), 0.0, 6.0));
}

std::string ClockTime(MonoNs running) {
  const long long seconds = running / kSecond;
  std::array<char, 32> text{};
  static_cast<void>(std::snprintf(text.data(), text.size(), "%02lld:%02lld:%02lld", seconds / 3600,
                                  seconds / 60 % 60, seconds % 60));
  return text.data();
}

std::string StateText(std::optional<std::int8_t> state, std::string_view (*name)(std::int8_t)) {
  return state ? std::string(name(*state)) : "SILENT";
}

std::string DeviceLine(const DeviceView& device, MonoNs now) {
  const std::string head = Left(device.name, 12) + ' ' + Left(StateText(device.State(now), DeviceStateName), 8) +
                           ' ' + Right(ValueText(device), 19) + ' ' + Right(Decimal(device.Turns(), 3), 10) + ' ' +
                           Right(Decimal(device.SpeedRpm(), 1), 8) + ' ';
  std::string note = AlarmText(device, kTableWidth - head.size());
  if (note.empty() && !device.Online(now) && device.info) note = Printable(device.info->reason);
  return head + Clip(note, kTableWidth - head.size());
}

// A section for encoders, one for motors; each only where there are any.
void AddDevices(const MachineView& machine, MonoNs now, std::vector<std::string>& lines) {
  std::vector<std::string> motors;
  std::vector<std::string> axes;
  for (const DeviceView& device : machine.devices()) {
    if (device.has_position) {
      axes.push_back(DeviceLine(device, now));
    } else {
      AddMotorRows(device, now, motors);
    }
  }
  const auto add = [&lines](const std::string& heading, const std::vector<std::string>& rows) {
    if (rows.empty()) return;
    lines.push_back(heading);
    lines.insert(lines.end(), rows.begin(), rows.end());
    lines.emplace_back();
  };
  add("DEVICE       STATE                  VALUE      TURNS      RPM ALARMS", axes);
  add(MotorHeading(), motors);
}

void AddBus(const BusView& bus, MonoNs now, std::vector<std::string>& lines) {
  const std::string head = Left(bus.name, 12) + ' ' + Left(StateText(bus.State(now), BusStateName), 8);
  if (!bus.health) {
    lines.push_back(head);
    return;
  }
  const bus_health_t& health = *bus.health;
  const std::string rate = Decimal(health.rate_hz, 0) + " of " + Decimal(health.wire_limit_hz, 0) + "/s " +
                           Right(Decimal(100.0 * health.utilisation, 1), 5) + " %";
  lines.push_back(head + ' ' + Right(rate, 25) + ' ' + Right(Decimal(health.exchange_us[1], 0), 6) +
                  Right(Decimal(health.exchange_us[2], 0), 6) + ' ' + Right(std::to_string(health.good), 10) +
                  Right(std::to_string(health.late), 8));
  const std::string errors = ErrorCounts(health.errors);
  if (!errors.empty()) lines.push_back(Clip("  errors: " + errors, kTableWidth));
  if (!bus.Up(now) && !health.last_error.empty()) {
    lines.push_back(Clip("  " + Printable(health.last_error), kTableWidth));
  }
}

// On as many lines as it needs, at most three.
void AddEvent(const std::string& event, std::vector<std::string>& lines) {
  constexpr std::size_t kMaxLines = 3;
  constexpr std::string_view kIndent = "    ";
  std::string rest = Printable(event);
  for (std::size_t line = 1; line < kMaxLines && rest.size() > kTableWidth; ++line) {
    const std::size_t space = rest.rfind(' ', kTableWidth);
    const std::size_t end = space == std::string::npos || space <= kIndent.size() ? kTableWidth : space;
    lines.push_back(rest.substr(0, end));
    rest = std::string(kIndent) + rest.substr(end + (end == space ? 1 : 0));
  }
  lines.push_back(Clip(rest, kTableWidth));
}

}  // namespace

std::string ValueText(const DeviceView& device) {
  if (!device.has_position) return device.motor ? MotorValueText(*device.motor) : "-";
  if (!device.valid) return "-";
  const int decimals = device.info ? DecimalsOf(*device.info) : 3;
  return Decimal(device.valid->value, decimals) + ' ' + std::string(UnitName(device.valid->unit));
}

std::string AlarmText(const DeviceView& device, std::size_t width) {
  const std::vector<alarm_entry_t>& alarms = device.alarms.entries();
  if (alarms.empty()) return "";
  const std::string more = alarms.size() > 1 ? " +" + std::to_string(alarms.size() - 1) : "";
  const std::size_t room = width > more.size() ? width - more.size() : 0;
  return Clip(Printable(alarms.front().name), room) + more;
}

std::vector<std::string> RenderTable(const MachineView& machine, MonoNs now, MonoNs running,
                                     const std::deque<std::string>& events) {
  const std::string title = "axlecast " + Printable(machine.machine()) + "  " + ClockTime(running) + "  " +
                            std::to_string(machine.online(now)) + " of " +
                            std::to_string(machine.devices().size()) + " devices online";
  std::vector<std::string> lines;
  lines.push_back(Left(title, kTableWidth - 12) + " Ctrl-C ends");
  lines.emplace_back();
  AddDevices(machine, now, lines);
  lines.emplace_back("BUS          STATE     EXCHANGES OF WIRE LIMIT p50 us   p99       GOOD    LATE");
  for (const BusView& bus : machine.buses()) AddBus(bus, now, lines);
  if (!events.empty()) {
    lines.emplace_back();
    for (const std::string& event : events) AddEvent(event, lines);
  }
  return lines;
}

std::string RenderLine(const MachineView& machine, MonoNs now, MonoNs running) {
  double hz = 0;
  std::int64_t lost = 0;
  for (const DeviceView& device : machine.devices()) {
    hz += device.reading_hz;
    lost += device.readings.lost();
  }
  return ClockTime(running) + "  " + std::to_string(machine.online(now)) + " of " +
         std::to_string(machine.devices().size()) + " devices online, " + Decimal(hz, 0) + " readings/s, " +
         std::to_string(lost) + " lost";
}

}  // namespace axlecast
