// The subscriber of the benchmarks: a plain liblcm program on its own thread, the same for the driver and its
// peers.
//
// receiver URL [--wire]
//
// Prints "ready" when it is subscribed; at SIGTERM handles what is left and prints one JSON object.
// Latency is the instant of the handler less the sender's instant: POSITION's mono_ns where the sender stamps just
// before it publishes; with --wire the return of the last read of the exchange in whose interval mono_ns lies, as
// the WIRE records have it.

#include <algorithm>
#include <axlecast/bus_health_t.hpp>
#include <axlecast/position_block_t.hpp>
#include <axlecast/position_t.hpp>
#include <axlecast/wire_t.hpp>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <lcm/lcm-cpp.hpp>
#include <string>
#include <vector>

#include "bench/distribution.h"
#include "bench/monotonic.h"

namespace axlecast::bench {
namespace {

constexpr std::size_t kWarmUp = 50;  // messages whose latency does not count
constexpr int kQueue = 100'000;

volatile std::sig_atomic_t stopped = 0;

// Counts the messages of one channel and those missing among their sequence numbers.
struct Stream {
  std::int64_t messages = 0;
  std::int64_t lost = 0;
  std::int64_t next = 0;

  void Count(std::int64_t seq) {
    if (messages++ > 0 && seq > next) lost += seq - next;
    next = seq + 1;
  }
};

struct Reading {
  std::int64_t mono_ns;
  std::int64_t handled;
};

struct WireExchange {
  std::int64_t begin;  // before the write
  std::int64_t end;    // return of the last read
};

class Receiver {
 public:
  Receiver(const char* url, bool wire) : lcm_(url) {
    if (!lcm_.good()) return;
    readings_.reserve(kQueue);
    Follow("POSITION/.*", &Receiver::OnPosition);
    Follow("POSITION_BLOCK/.*", &Receiver::OnBlock);
    Follow("BUS/.*", &Receiver::OnBus);
    if (wire) Follow("WIRE/.*", &Receiver::OnWire);
  }

  [[nodiscard]] bool good() const { return lcm_.good(); }

  [[nodiscard]] bool Run() {
    while (stopped == 0) {
      if (lcm_.handleTimeout(20) < 0 && stopped == 0) return false;
    }
    while (lcm_.handleTimeout(50) > 0) continue;
    return true;
  }

  void Print() const {
    std::printf("{\"positions\": %lld, \"positions_lost\": %lld, \"first_position_ns\": %lld, ",
                static_cast<long long>(positions_.messages), static_cast<long long>(positions_.lost),
                static_cast<long long>(readings_.empty() ? 0 : readings_.front().handled));
    std::printf("\"blocks\": %lld, \"blocks_lost\": %lld, \"samples\": %lld, \"missed\": %lld, ",
                static_cast<long long>(blocks_.messages), static_cast<long long>(blocks_.lost),
                static_cast<long long>(samples_), static_cast<long long>(missed_));
    std::printf("\"bus\": {\"messages\": %lld, \"exchanges\": %lld, \"good\": %lld, \"seconds\": %.6f}, ",
                static_cast<long long>(buses_.messages), static_cast<long long>(exchanges_),
                static_cast<long long>(good_), static_cast<double>(last_bus_ns_ - first_bus_ns_) * 1e-9);
    PrintDistribution("latency", Latencies());
    std::printf("}\n");
  }

 private:
  template <typename Message>
  void Follow(const char* channel,
              void (Receiver::*handler)(const lcm::ReceiveBuffer*, const std::string&, const Message*)) {
    lcm_.subscribe(channel, handler, this)->setQueueCapacity(kQueue);
  }

  void OnPosition(const lcm::ReceiveBuffer*, const std::string&, const position_t* position) {
    readings_.push_back({position->mono_ns, MonotonicNow()});
    positions_.Count(position->seq);
  }

  void OnBlock(const lcm::ReceiveBuffer*, const std::string&, const position_block_t* block) {
    blocks_.Count(block->seq);
    samples_ += block->n;
    missed_ += block->missed;
  }

  void OnBus(const lcm::ReceiveBuffer*, const std::string&, const bus_health_t* bus) {
    buses_.Count(bus->seq);
    if (buses_.messages == 1) first_bus_ns_ = bus->mono_ns;
    last_bus_ns_ = bus->mono_ns;
    exchanges_ = bus->exchanges;
    good_ = bus->good;
  }

  void OnWire(const lcm::ReceiveBuffer*, const std::string&, const wire_t* wire) {
    for (const wire_record_t& record : wire->records) {
      const std::int64_t at = wire->mono_ns + record.dt_ns;
      if (record.direction == wire_record_t::DIRECTION_TRANSMIT) {
        exchanges_seen_.push_back({at, at});
      } else if (record.direction == wire_record_t::DIRECTION_RECEIVE && !exchanges_seen_.empty()) {
        exchanges_seen_.back().end = at + record.duration_ns;
      }
    }
  }

  [[nodiscard]] std::vector<std::int64_t> Latencies() const {
    std::vector<std::int64_t> latencies;
    for (std::size_t i = kWarmUp; i < readings_.size(); ++i) {
      const Reading& reading = readings_[i];
      if (exchanges_seen_.empty()) {
        latencies.push_back(reading.handled - reading.mono_ns);
        continue;
      }
      const auto after =
          std::upper_bound(exchanges_seen_.begin(), exchanges_seen_.end(), reading.mono_ns,
                           [](std::int64_t at, const WireExchange& exchange) { return at < exchange.begin; });
      if (after == exchanges_seen_.begin() || std::prev(after)->end < reading.mono_ns) continue;
      latencies.push_back(reading.handled - std::prev(after)->end);
    }
    return latencies;
  }

  lcm::LCM lcm_;
  Stream positions_, blocks_, buses_;
  std::vector<Reading> readings_;
  std::vector<WireExchange> exchanges_seen_;
  std::int64_t samples_ = 0;
  std::int64_t missed_ = 0;
  std::int64_t first_bus_ns_ = 0;
  std::int64_t last_bus_ns_ = 0;
  std::int64_t exchanges_ = 0;
  std::int64_t good_ = 0;
};

int Main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: receiver URL [--wire]\n");
    return 2;
  }
  struct sigaction stop {};
  stop.sa_handler = [](int) { stopped = 1; };
  sigaction(SIGTERM, &stop, nullptr);
  Receiver receiver(argv[1], argc > 2 && std::strcmp(argv[2], "--wire") == 0);
  if (!receiver.good()) return 1;
  std::printf("ready\n");
  std::fflush(stdout);
  if (!receiver.Run()) return 1;
  receiver.Print();
  return 0;
}

}  // namespace
}  // namespace axlecast::bench

int main(int argc, char** argv) { return axlecast::bench::Main(argc, argv); }
