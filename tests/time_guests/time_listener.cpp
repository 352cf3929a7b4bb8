// Runs in a guest: writes every TIME, POSITION and POSITION_SET message that arrives to an LCM log, whose times are CLOCK_MONOTONIC in us instead of UNIX time, which
// the test steps. Ends when it is killed; the log is complete up to the newest message.
//
//   time_listener URL FILE
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "platform/net/lcm_port.h"
#include "platform/os/system_clock.h"
#include "tools/log/log_event.h"

namespace axlecast {
namespace {

int Run(const char* url, const char* path) {
  std::FILE* file = std::fopen(path, "ab");
  if (file == nullptr) {
    std::fprintf(stderr, "cannot write %s: %s\n", path, std::strerror(errno));
    return 1;
  }
  const SystemClock clock;
  LogEncoder log;
  bool written = true;
  LcmPort port(url, "");
  port.Subscribe("(TIME|POSITION|POSITION_SET)/.*", [&](const std::string& channel, Bytes message) {
    const Bytes record = log.Add({.utime = clock.Now() / kMicrosecond, .channel = channel, .data = message});
    written = std::fwrite(record.data(), 1, record.size(), file) == record.size() && std::fflush(file) == 0;
  });
  if (!port.problem().empty()) {
    std::fprintf(stderr, "%s\n", port.problem().c_str());
    return 1;
  }
  while (written && port.Handle(1'000)) {
  }
  std::fprintf(stderr, "cannot write to %s, or receive: %s\n", path, std::strerror(errno));
  return 1;
}

}  // namespace
}  // namespace axlecast

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: time_listener URL FILE\n");
    return 2;
  }
  return axlecast::Run(argv[1], argv[2]);
}
