// The subscriber of the receiving benchmark: POSITION through LcmPort, as every process of axlecast receives. Its peer is
// receiver.cpp, a plain liblcm program; both take the same sender (bare_publish).
//
// port_receiver URL
//
// Prints "ready" when it is subscribed; at SIGTERM handles what is left and prints one JSON object. Latency is the instant of
// the handler less POSITION's mono_ns.

#include <axlecast/position_t.hpp>
#include <csignal>
#include <cstdio>
#include <vector>

#include "bench/distribution.h"
#include "bench/monotonic.h"
#include "core/messages/message.h"
#include "platform/net/lcm_port.h"

namespace {

constexpr std::size_t kWarmUp = 50;  // messages whose latency does not count

volatile std::sig_atomic_t stopped = 0;

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: port_receiver URL\n");
    return 2;
  }
  std::vector<std::int64_t> latencies;
  latencies.reserve(100'000);
  axlecast::LcmPort port(argv[1], "");
  const bool subscribed = port.Subscribe("POSITION/.*", [&latencies](const std::string&, axlecast::Bytes message) {
    const auto position = axlecast::DecodeMessage<axlecast::position_t>(message);
    if (position) latencies.push_back(axlecast::bench::MonotonicNow() - position->mono_ns);
  });
  if (!subscribed) {
    std::fprintf(stderr, "%s\n", port.problem().c_str());
    return 1;
  }
  static_cast<void>(std::signal(SIGTERM, [](int) { stopped = 1; }));
  std::printf("ready\n");
  std::fflush(stdout);
  while (stopped == 0) {
    if (!port.Handle(20)) return 1;
  }
  static_cast<void>(port.Handle(50));
  std::printf("{\"dropped\": %lld, ", static_cast<long long>(port.received().dropped));
  if (latencies.size() > kWarmUp) latencies.erase(latencies.begin(), latencies.begin() + kWarmUp);
  axlecast::bench::PrintDistribution("latency", std::move(latencies));
  std::printf("}\n");
  return 0;
}
