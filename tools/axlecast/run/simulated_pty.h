#pragma once

#include <array>
#include <string>

#include "drivers/hal/pty.h"
#include "drivers/hal/simulated_port.h"

namespace axlecast {

// A simulated line of characters: a pty.
class SimulatedPty final : public SimulatedPort {
 public:
  // `path`: of the link that a host opens.
  SimulatedPty(std::string path, Simulator& simulator, const Clock& clock)
      : SimulatedPort(simulator, clock), path_(std::move(path)) {}

  [[nodiscard]] std::string Plug() override;
  void Unplug() override;
  [[nodiscard]] bool HasHost() const override { return has_host_; }
  // A pty without a host would report that at once, again and again: then it is looked for from time to time.
  [[nodiscard]] int FileDescriptor() const override { return has_host_ ? pty_.FileDescriptor() : -1; }
  [[nodiscard]] MonoNs NextDue() const override { return look_at_; }
  void Serve() override;
  void Transmit(Bytes bytes) override;

 private:
  [[nodiscard]] std::int64_t Baud() const override { return has_host_ ? pty_.Baud() : 0; }
  void LookForHost();

  const std::string path_;
  Pty pty_;
  bool has_host_ = false;
  MonoNs look_at_ = kNever;
  std::array<std::uint8_t, 512> received_{};
};

}  // namespace axlecast
