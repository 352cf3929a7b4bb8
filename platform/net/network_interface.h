#pragma once

#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/messages/lcm_url.h"

namespace axlecast {

// An interface of this host, as `ip link` shows it.
struct NetworkInterface {
  std::string name;
  unsigned index = 0;    // of the kernel: another one if the interface was deleted and made again
  bool up = false;       // `ip link set NAME up`
  bool carrier = false;  // its cable leads to a device that is on
  bool loopback = false;
};

// Returns all interfaces of this host.
[[nodiscard]] std::vector<NetworkInterface> Interfaces();

// Finds the interface that the text selects: see IsInterface. The error states what is missing and the command that lists what
// exists. Also used while the machine runs: reads the kernel's tables, and waits for nothing.
[[nodiscard]] Result<NetworkInterface> FindInterface(const std::string& text);

// Follows the interface of an LCM URL while it is deleted, made again, and goes down and up. Used by one thread.
class InterfaceWatch {
 public:
  explicit InterfaceWatch(const LcmUrl& url) : text_(url.interface), leaves_host_(url.ttl > 0) { Update(); }

  // Reads the present state.
  void Update();

  [[nodiscard]] unsigned index() const { return index_; }  // 0: the interface does not exist
  // Returns why LCM does not reach everyone by this interface, with the remedy; empty: it does.
  [[nodiscard]] const std::string& problem() const { return problem_; }

 private:
  std::string text_;
  bool leaves_host_;
  unsigned index_ = 0;
  std::string problem_;
};

}  // namespace axlecast
