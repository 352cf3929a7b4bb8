// What the bridge adds to the device's own time of a command.
//
// command_times CONFIG COUNT DEVICE OPERATION [KEY=VALUE]...   a value "A|B" alternates
//
// Sends the command COUNT times with the client library, one after the other, and listens on the command port. Prints
// one JSON object of distributions:
//   total      Send to the end of Await
//   device     started_utime to finished_utime, as the driver reports
//   added      the difference of both, of each command
// and the parts on the way, by the messages' arrival at the listener, because a mono_ns is the instant at which its
// sender began:
//   accept     COMMAND to the bridge's ACCEPTED: transport, signature, and of a changing one the journal
//   route      ACCEPTED to DRIVER_COMMAND: of a changing one the journal
//   order      DRIVER_COMMAND to the driver's first word
//   outcome    the driver's last word to the bridge's outcome: of a changing one the journal

#include <axlecast/command_client.h>
#include <axlecast/machine_settings.h>

#include <atomic>
#include <axlecast/command_body_t.hpp>
#include <axlecast/command_t.hpp>
#include <axlecast/driver_command_t.hpp>
#include <axlecast/driver_order_t.hpp>
#include <axlecast/driver_status_t.hpp>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <lcm/lcm-cpp.hpp>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "bench/command_id.h"
#include "bench/distribution.h"
#include "bench/monotonic.h"

namespace axlecast::bench {
namespace {

// Instants of one command, CLOCK_MONOTONIC; 0: not seen.
struct Times {
  std::int64_t commanded = 0;
  std::int64_t accepted = 0;
  std::int64_t ordered = 0;
  std::int64_t acknowledged = 0;
  std::int64_t driver_ended = 0;
  std::int64_t ended = 0;
};

void SetFirst(std::int64_t& instant, std::int64_t at) {
  if (instant == 0) instant = at;
}

class Listener {
 public:
  explicit Listener(const std::string& url) : lcm_(url) {
    if (!lcm_.good()) return;
    lcm_.subscribe("COMMAND", &Listener::OnCommand, this);
    lcm_.subscribe("COMMAND_STATUS", &Listener::OnStatus, this);
    lcm_.subscribe("DRIVER_COMMAND/.*", &Listener::OnOrder, this);
    lcm_.subscribe("DRIVER_STATUS/.*", &Listener::OnDriver, this);
    thread_ = std::thread([this] {
      while (!stop_) lcm_.handleTimeout(20);
    });
  }
  ~Listener() { Stop(); }

  [[nodiscard]] bool good() const { return lcm_.good(); }
  // What was received until now; afterwards nothing more is.
  const std::map<Id, Times>& Stop() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
    return times_;
  }

 private:
  void OnCommand(const lcm::ReceiveBuffer*, const std::string&, const command_t* command) {
    command_body_t body;
    if (body.decode(command->body.data(), 0, command->body_size) < 0) return;
    if (body.mode == command_body_t::MODE_EXECUTE) SetFirst(times_[IdOf(body)].commanded, MonotonicNow());
  }

  void OnStatus(const lcm::ReceiveBuffer*, const std::string&, const command_status_t* status) {
    Times& times = times_[IdOf(*status)];
    if (status->state == command_status_t::STATE_ACCEPTED) SetFirst(times.accepted, MonotonicNow());
    if (status->is_final != 0) SetFirst(times.ended, MonotonicNow());
  }

  void OnOrder(const lcm::ReceiveBuffer*, const std::string&, const driver_command_t* command) {
    driver_order_t order;
    if (order.decode(command->order.data(), 0, command->order_size) < 0) return;
    if (order.kind == driver_order_t::KIND_EXECUTE) SetFirst(times_[IdOf(order)].ordered, MonotonicNow());
  }

  void OnDriver(const lcm::ReceiveBuffer*, const std::string&, const driver_status_t* status) {
    if (status->kind != driver_status_t::KIND_STATUS) return;
    Times& times = times_[IdOf(*status)];
    SetFirst(times.acknowledged, MonotonicNow());
    if (status->finished_utime != 0) SetFirst(times.driver_ended, MonotonicNow());
  }

  lcm::LCM lcm_;
  std::map<Id, Times> times_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

// "A|B": A of the even commands, B of the odd ones.
std::string Alternating(const std::string& value, int number) {
  const std::size_t bar = value.find('|');
  if (bar == std::string::npos) return value;
  return number % 2 == 0 ? value.substr(0, bar) : value.substr(bar + 1);
}

struct Distributions {
  std::map<std::string, std::vector<std::int64_t>> of;

  void Add(const char* name, std::int64_t from, std::int64_t to) {
    if (from != 0 && to != 0) of[name].push_back(to - from);
  }
  void Print() const {
    const char* separator = "{";
    for (const auto& [name, durations] : of) {
      std::printf("%s", separator);
      PrintDistribution(name.c_str(), durations);
      separator = ", ";
    }
    std::printf("}\n");
  }
};

int Fail(const std::string& problem) {
  std::fprintf(stderr, "%s\n", problem.c_str());
  return 1;
}

int Main(int argc, char** argv) {
  if (argc < 5) return Fail("usage: command_times CONFIG COUNT DEVICE OPERATION [KEY=VALUE]...");
  const auto settings = axlecast::SettingsOfMachine(argv[1], "");
  if (!settings) return Fail(settings.error().text);
  CommandClient client(*settings);
  if (const auto usable = client.state(); !usable) return Fail(usable.error().text);
  Listener listener(settings->command_url);
  if (!listener.good()) return Fail("cannot listen on " + settings->command_url);

  Distributions distributions;
  const int count = std::atoi(argv[2]);
  for (int i = 0; i < count; ++i) {
    CommandRequest request;
    request.device = argv[3];
    request.operation = argv[4];
    for (int a = 5; a < argc; ++a) {
      const std::string word = argv[a];
      const std::size_t equals = word.find('=');
      if (equals == std::string::npos) return Fail(word + " is no KEY=VALUE");
      request.arguments.emplace_back(word.substr(0, equals), Alternating(word.substr(equals + 1), i));
    }
    const std::int64_t begin = MonotonicNow();
    const CommandResult result = client.Await(client.Send(request), 60'000);
    const std::int64_t total = MonotonicNow() - begin;
    if (result.outcome() != CommandOutcome::kDone)
      return Fail(request.operation + ": " + result.status.text + result.problem);
    const std::int64_t device = (result.status.finished_utime - result.status.started_utime) * 1'000;
    if (i == 0) continue;  // it asks for the bridge's boot id first
    distributions.of["total"].push_back(total);
    distributions.of["device"].push_back(device);
    distributions.of["added"].push_back(total - device);
  }
  for (const auto& [id, times] : listener.Stop()) {
    distributions.Add("accept", times.commanded, times.accepted);
    distributions.Add("route", times.accepted, times.ordered);
    distributions.Add("order", times.ordered, times.acknowledged);
    distributions.Add("outcome", times.driver_ended, times.ended);
  }
  distributions.Print();
  return 0;
}

}  // namespace
}  // namespace axlecast::bench

int main(int argc, char** argv) { return axlecast::bench::Main(argc, argv); }
