#pragma once

#include <fcntl.h>
#include <termios.h>

namespace axlecast::bench {

// Opens a serial port as the bare loops use it: raw, and read(2) waits for the first byte. Returns -1 with errno set if that fails.
inline int OpenRaw(const char* path) {
  const int port = open(path, O_RDWR | O_NOCTTY | O_CLOEXEC);
  termios settings{};
  if (port < 0 || tcgetattr(port, &settings) != 0) return -1;
  cfmakeraw(&settings);
  cfsetspeed(&settings, B2500000);  // at another rate the simulator receives noise
  settings.c_cc[VMIN] = 1;
  settings.c_cc[VTIME] = 0;
  return tcsetattr(port, TCSANOW, &settings) == 0 ? port : -1;
}

}  // namespace axlecast::bench
