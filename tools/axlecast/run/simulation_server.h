#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/base/time.h"
#include "core/device/family.h"
#include "core/device/simulator.h"
#include "drivers/hal/pulse_lines.h"
#include "drivers/hal/simulated_port.h"
#include "platform/os/descriptor.h"
#include "platform/os/folder.h"

struct pollfd;

namespace axlecast {

// A local socket of mode 0600. Another process of the same user connects, sends one question and receives one answer.
class ControlSocket {
 public:
  using Handler = std::function<std::string(const std::string& question)>;

  ControlSocket() = default;
  ~ControlSocket();
  ControlSocket(const ControlSocket&) = delete;
  ControlSocket& operator=(const ControlSocket&) = delete;

  // Replaces the socket of a process that has ended. The caller must ensure that no other process listens at `path`.
  [[nodiscard]] Result<> Listen(const std::string& path);
  // Readable if Serve has work.
  [[nodiscard]] int FileDescriptor() const { return events_.get(); }
  // Answers the received questions without waiting.
  void Serve(const Handler& handler);

 private:
  void Accept();

  std::string path_;
  Descriptor events_;
  Descriptor listener_;
  std::deque<Descriptor> callers_;
};

// Returns the answer of the process that listens at `path`; an empty text if no process listens or answers within 2 s.
[[nodiscard]] std::string AskControlSocket(const std::string& path, const std::string& question);

// Provides simulated buses to drivers. Other processes can query and change the buses. Run belongs to one thread.
class SimulationServer {
 public:
  explicit SimulationServer(const Clock& clock);

  struct BusPlace {
    std::string bus;
    std::vector<std::string> devices;
    LinkKind link = LinkKind::kSerial;
    std::string port;            // the path that a driver opens: the link of the pty, or the socket
    std::string control;         // path of the control socket
    std::string lock;            // path of the lock: one simulator per bus
    std::string lines = {};      // path of the socket for pulses on additional lines; empty: no such lines
    std::string interface = {};  // of a CAN bus: the nodes use this interface, and `port` is not created
  };
  // Adds a bus. Call it before Run.
  [[nodiscard]] Result<> Add(BusPlace place, std::unique_ptr<Simulator> simulator);

  // Serves until Stop.
  [[nodiscard]] Result<> Run();
  // May be called from any thread and from a signal handler.
  void Stop();

 private:
  struct Bus {
    BusPlace place;
    std::unique_ptr<Simulator> simulator;
    LockFile lock;
    std::unique_ptr<SimulatedPort> port;
    SimulatedLinesPort lines;
    ControlSocket control;
    bool plugged = true;
  };

  [[nodiscard]] MonoNs NextDue() const;
  void FillPolls(std::vector<pollfd>& polls) const;
  void ServeBus(Bus& bus, std::span<const pollfd> polls);
  void OnPulses(Bus& bus);
  [[nodiscard]] std::string Answer(Bus& bus, const std::string& question);
  [[nodiscard]] nlohmann::ordered_json Change(Bus& bus, const nlohmann::ordered_json& question);
  [[nodiscard]] nlohmann::ordered_json Show(const Bus& bus) const;

  const Clock& clock_;
  WakeEvent stop_;
  std::vector<std::unique_ptr<Bus>> buses_;
};

}  // namespace axlecast
