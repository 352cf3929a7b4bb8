#pragma once

#include <array>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "drivers/io/pty.h"
#include "drivers/io/run_directory.h"
#include "drivers/io/simulated_lines.h"
#include "drivers/runtime/core/clock.h"
#include "drivers/runtime/core/simulator.h"
#include "tools/axlecast/control_socket.h"

struct pollfd;

namespace axlecast {

// Puts simulated buses on ptys and lets other processes look at them and change them. Run belongs to one thread.
class SimulationServer {
 public:
  explicit SimulationServer(const Clock& clock);

  struct BusPlace {
    std::string bus;
    std::vector<std::string> devices;
    std::string pty;         // path of the link that a driver opens
    std::string control;     // path of the control socket
    std::string lock;        // path of the lock: one simulator per bus
    std::string lines = {};  // path of the socket for pulses on the lines beside the bus; empty: it has none
  };
  // An empty string when the bus is ready, else the cause and the remedy. Before Run.
  [[nodiscard]] std::string Add(BusPlace place, std::unique_ptr<Simulator> simulator);

  // Serves until Stop. An empty string, or why it could not go on.
  [[nodiscard]] std::string Run();
  // From any thread, or from a signal handler.
  void Stop();

 private:
  struct Bus {
    BusPlace place;
    std::unique_ptr<Simulator> simulator;
    LockFile lock;
    Pty pty;
    std::int64_t baud = 0;  // that the simulator was told of
    SimulatedLinesPort lines;
    ControlSocket control;
    Simulator::Transmit transmit;
    bool has_host = false;
    bool plugged = true;
  };

  [[nodiscard]] MonoNs NextDue() const;
  void FillPolls(std::vector<pollfd>& polls) const;
  // Tells the simulator of the rate that the host has set, when it is a new one.
  static void TellBaud(Bus& bus);
  void OnPty(Bus& bus, const pollfd& poll, MonoNs now);
  void OnPulses(Bus& bus);
  void LookForHost(Bus& bus);
  [[nodiscard]] std::string Answer(Bus& bus, const std::string& question);
  [[nodiscard]] nlohmann::ordered_json Change(Bus& bus, const nlohmann::ordered_json& question);
  [[nodiscard]] nlohmann::ordered_json Show(const Bus& bus) const;

  const Clock& clock_;
  Descriptor stop_;
  std::vector<std::unique_ptr<Bus>> buses_;
  std::array<std::uint8_t, 512> received_{};
};

}  // namespace axlecast
