#pragma once

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <thread>

#include "drivers/hal/simulated_port.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// Serves the port while `act` runs on a thread of its own; what `act` returned.
template <typename Act>
auto Served(SimulatedPort& port, Act act) {
  const Descriptor done(eventfd(0, EFD_CLOEXEC));
  decltype(act()) result{};
  std::thread host([&] {
    result = act();
    const std::uint64_t one = 1;
    static_cast<void>(!write(done.get(), &one, sizeof one));
  });
  std::array<pollfd, 2> files{{{done.get(), POLLIN, 0}, {port.FileDescriptor(), POLLIN, 0}}};
  while (poll(files.data(), files.size(), 5'000) > 0) {
    port.Serve();
    if (files[0].revents != 0) break;
  }
  host.join();
  return result;
}

}  // namespace axlecast
