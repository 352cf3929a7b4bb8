// How soon a driver acknowledges: listens on the command port while others command.
//
// acknowledgements COMMAND_URL
//
// Prints "ready" when it is subscribed; at SIGTERM prints one JSON object: the time from a client's first COMMAND
// (its mono_ns) and from the bridge's first DRIVER_COMMAND to the arrival of the driver's first DRIVER_STATUS of
// that id.

#include <axlecast/command_body_t.hpp>
#include <axlecast/command_t.hpp>
#include <axlecast/driver_command_t.hpp>
#include <axlecast/driver_order_t.hpp>
#include <axlecast/driver_status_t.hpp>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <lcm/lcm-cpp.hpp>
#include <map>
#include <string>
#include <vector>

#include "bench/command_id.h"
#include "bench/distribution.h"
#include "bench/monotonic.h"

namespace axlecast::bench {
namespace {

volatile std::sig_atomic_t stopped = 0;

// First instants of one command; 0: not seen.
struct Times {
  std::int64_t commanded = 0;
  std::int64_t ordered = 0;
  std::int64_t acknowledged = 0;
};

class Acknowledgements {
 public:
  explicit Acknowledgements(const char* url) : lcm_(url) {
    if (!lcm_.good()) return;
    lcm_.subscribe("COMMAND", &Acknowledgements::OnCommand, this);
    lcm_.subscribe("DRIVER_COMMAND/.*", &Acknowledgements::OnOrder, this);
    lcm_.subscribe("DRIVER_STATUS/.*", &Acknowledgements::OnStatus, this);
  }

  [[nodiscard]] bool good() const { return lcm_.good(); }

  [[nodiscard]] bool Run() {
    while (stopped == 0) {
      if (lcm_.handleTimeout(20) < 0 && stopped == 0) return false;
    }
    return true;
  }

  void Print() const {
    std::vector<std::int64_t> from_command;
    std::vector<std::int64_t> from_order;
    for (const auto& [id, times] : commands_) {
      if (times.acknowledged == 0) continue;
      if (times.commanded != 0) from_command.push_back(times.acknowledged - times.commanded);
      if (times.ordered != 0) from_order.push_back(times.acknowledged - times.ordered);
    }
    std::printf("{");
    PrintDistribution("from_command", from_command);
    std::printf(", ");
    PrintDistribution("from_order", from_order);
    std::printf("}\n");
  }

 private:
  static void SetFirst(std::int64_t& instant, std::int64_t at) {
    if (instant == 0) instant = at;
  }

  void OnCommand(const lcm::ReceiveBuffer*, const std::string&, const command_t* command) {
    command_body_t body;
    if (body.decode(command->body.data(), 0, command->body_size) < 0) return;
    if (body.mode == command_body_t::MODE_EXECUTE) SetFirst(commands_[IdOf(body)].commanded, command->mono_ns);
  }

  void OnOrder(const lcm::ReceiveBuffer*, const std::string&, const driver_command_t* command) {
    driver_order_t order;
    if (order.decode(command->order.data(), 0, command->order_size) < 0) return;
    if (order.kind == driver_order_t::KIND_EXECUTE) SetFirst(commands_[IdOf(order)].ordered, command->mono_ns);
  }

  void OnStatus(const lcm::ReceiveBuffer*, const std::string&, const driver_status_t* status) {
    if (status->kind == driver_status_t::KIND_STATUS)
      SetFirst(commands_[IdOf(*status)].acknowledged, MonotonicNow());
  }

  lcm::LCM lcm_;
  std::map<Id, Times> commands_;
};

int Main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: acknowledgements COMMAND_URL\n");
    return 2;
  }
  struct sigaction stop {};
  stop.sa_handler = [](int) { stopped = 1; };
  sigaction(SIGTERM, &stop, nullptr);
  Acknowledgements acknowledgements(argv[1]);
  if (!acknowledgements.good()) return 1;
  std::printf("ready\n");
  std::fflush(stdout);
  if (!acknowledgements.Run()) return 1;
  acknowledgements.Print();
  return 0;
}

}  // namespace
}  // namespace axlecast::bench

int main(int argc, char** argv) { return axlecast::bench::Main(argc, argv); }
