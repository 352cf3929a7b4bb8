#pragma once

#include <array>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "drivers/io/pty.h"
#include "drivers/io/run_directory.h"
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
    std::string pty;      // path of the link that a driver opens
    std::string control;  // path of the control socket
    std::string lock;     // path of the lock: one simulator per bus
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
    ControlSocket control;
    Simulator::Transmit transmit;
    bool has_host = false;
    bool plugged = true;
  };

  [[nodiscard]] MonoNs NextDue() const;
  void FillPolls(std::vector<pollfd>& polls) const;
  void OnPty(Bus& bus, const pollfd& poll, MonoNs now);
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
