#include "tools/axlecast/run/simulated_pty.h"

namespace axlecast {
namespace {

constexpr MonoNs kHostCheck = 10 * kMillisecond;  // how soon a host that opens the line is noticed

}  // namespace

std::string SimulatedPty::Plug() {
  Unplug();
  std::string problem = pty_.Open(path_);
  if (problem.empty()) LookForHost();
  return problem;
}

void SimulatedPty::Unplug() {
  has_host_ = false;
  look_at_ = kNever;
  pty_.Close();
}

void SimulatedPty::LookForHost() {
  has_host_ = pty_.HasHost();
  look_at_ = has_host_ ? kNever : Now() + kHostCheck;
}

void SimulatedPty::Serve() {
  if (!pty_.IsOpen()) return;
  if (!has_host_) LookForHost();
  if (!has_host_) return;
  TellBaud();
  const std::size_t count = pty_.Read(received_);
  if (count > 0) return simulator().OnBytes(Bytes(received_).first(count), Now(), [this](Bytes b) { Transmit(b); });
  LookForHost();
  if (!has_host_) pty_.Discard();
}

void SimulatedPty::Transmit(Bytes bytes) {
  if (has_host_) static_cast<void>(pty_.Write(bytes));
}

}  // namespace axlecast
