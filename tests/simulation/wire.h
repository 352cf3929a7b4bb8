#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "core/config/machine_config.h"
#include "core/device/link.h"
#include "core/device/simulator.h"
#include "drivers/runtime/process/driver.h"
#include "tests/simulation/host.h"
#include "tests/simulation/process_thread.h"
#include "tests/simulation/schedule.h"

namespace axlecast::simulation {

// What the cable between a driver and its devices does.
struct WireFaults {
  bool unplugged = false;
  // Share of the transmissions from devices of which one bit is inverted: every protocol can detect that.
  double noise = 0;
  double loss = 0;         // share of transmissions from devices
  double stray = 0;        // share of transmissions after which a random byte follows
  MonoNs late = 0;         // transmissions from devices arrive up to so much later
  bool scattered = false;  // later ones may overtake
};

// A wire with simulated devices at its end. The devices act at their time, whatever the driver does. The simulator's time is
// CLOCK_MONOTONIC of the driver's host. It outlives the driver's process.
class Wire {
 public:
  Wire(Schedule& schedule, Host& host, ProcessThread& thread, Simulator& simulator, std::uint64_t seed);
  virtual ~Wire() = default;
  Wire(const Wire&) = delete;
  Wire& operator=(const Wire&) = delete;

  // Puts it where a driver finds it.
  virtual void PlugInto(DriverPorts& ports) = 0;
  // The process that had it open has ended: the kernel closes it.
  virtual void Release() = 0;
  // After a change of a device from outside: its next action may be due earlier.
  void Follow();

  WireFaults faults;

 protected:
  // A transmission of a device has arrived at the driver's host.
  virtual void OnArrival(Bytes bytes) = 0;
  [[nodiscard]] virtual bool ArrivesDamaged() const { return true; }

  // What a device transmits now, through the faults of the wire.
  [[nodiscard]] Simulator::Transmit Transmit();
  [[nodiscard]] std::vector<std::uint8_t> Damaged(Bytes bytes);

  // From the driver's thread: sleeps until `arrived` is true, until WakeThread, or until then. `can_be_lost`: it notices that it is
  // unplugged.
  [[nodiscard]] Link::Status WaitFor(const std::function<bool()>& arrived, bool can_be_lost, MonoNs until);
  void WakeThread();

  Schedule& schedule_;
  Host& host_;
  ProcessThread& thread_;
  Simulator& simulator_;
  Random random_;

 private:
  void Arrive(std::vector<std::uint8_t> bytes);

  bool woken_ = false;
  std::int64_t follows_ = 0;  // the newest planned action is valid
  MonoNs planned_ = kNever;
  MonoNs last_arrival_ = 0;
};

// Returns the wire that the family of the bus needs.
[[nodiscard]] std::unique_ptr<Wire> MakeWire(const BusConfig& bus, Schedule& schedule, Host& host,
                                             ProcessThread& thread, Simulator& simulator, std::uint64_t seed);

}  // namespace axlecast::simulation
