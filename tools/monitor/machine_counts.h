#pragma once

#include <array>
#include <cstddef>

#include "core/base/time.h"
#include "tools/monitor/machine_view.h"

namespace axlecast {

// Numbers of parts of a machine by their state, for a machine that has too many parts for one screen.
struct MachineCounts {
  static constexpr std::size_t kStates = 4;      // device_info_t and bus_health_t STATE_*
  static constexpr std::size_t kSeverities = 4;  // alarm_entry_t SEVERITY_*

  struct States {
    std::size_t total = 0;
    std::array<std::size_t, kStates> of{};  // by STATE_*
    std::size_t silent = 0;                 // no recent message
  };
  struct Hosts {
    std::size_t total = 0;   // of the machine file, and those that published TIME
    std::size_t silent = 0;  // nothing arrives from their buses, or their TIME has ended
    std::size_t claims = 0;  // claim an interval of the time base
  };
  struct Alarms {
    std::array<std::size_t, kSeverities> of{};  // by SEVERITY_*, without shelved alarms
    std::size_t shelved = 0;
  };

  States devices;
  States buses;
  Hosts hosts;
  Alarms alarms;  // of devices, of the bridge and of the connection to the broker
};

[[nodiscard]] MachineCounts CountParts(const MachineView& machine, MonoNs now);

// Returns true if an operator should look at the device: it is not ONLINE, or it has an alarm of severity WARNING or worse that is
// not shelved.
[[nodiscard]] bool NeedsAttention(const DeviceView& device, MonoNs now);

}  // namespace axlecast
