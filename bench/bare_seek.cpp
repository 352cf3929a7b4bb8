// The peer of replay's seek: liblcm's own reader of event logs. Publishes the first event that is not before a time.
//
// bare_seek seek|read LOG UTIME URL: by lcm_eventlog_seek_to_timestamp, or reading all that is before it

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <lcm/lcm-cpp.hpp>

int main(int argc, char** argv) {
  if (argc != 5) {
    std::fprintf(stderr, "usage: bare_seek seek|read LOG UTIME URL\n");
    return 2;
  }
  lcm::LogFile log(argv[2], "r");
  lcm::LCM lcm(argv[4]);
  if (!log.good() || !lcm.good()) return 1;
  const std::int64_t utime = std::atoll(argv[3]);
  if (std::strcmp(argv[1], "seek") == 0 && log.seekToTimestamp(utime) != 0) return 1;
  const lcm::LogEvent* event = log.readNextEvent();
  while (event != nullptr && event->timestamp < utime) event = log.readNextEvent();
  if (event == nullptr) return 1;
  return lcm.publish(event->channel, event->data, static_cast<unsigned>(event->datalen)) == 0 ? 0 : 1;
}
