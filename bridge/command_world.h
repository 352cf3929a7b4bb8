#pragma once

#include <axlecast/command_body_t.hpp>
#include <axlecast/command_status_t.hpp>
#include <axlecast/command_t.hpp>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <queue>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "bridge/dispatcher.h"
#include "bridge/memory_journal.h"
#include "drivers/runtime/command/order_desk.h"
#include "drivers/runtime/command/order_ledger.h"
#include "drivers/runtime/command/order_test_support.h"

namespace axlecast {

// For tests: clients, a bridge, drivers and devices in virtual time, on a network that loses, doubles and reorders.
// The devices count what was really done to them under each id.

struct WorldSettings {
  std::uint32_t seed = 1;
  double loss = 0;  // of any message
  double duplication = 0;
  int max_delay_ms = 0;  // evenly spread: reorders
  int buses = 5;
  int devices_per_bus = 4;
  double restarts_per_s = 0;  // of each driver, killed at any moment
  double cancels = 0;         // share of commands that their client gives up after a while
  double short_lived = 0;     // share of commands that may wait for 1..100 ms only
};

class WorldClock final : public Clock {
 public:
  [[nodiscard]] MonoNs Now() const override { return now; }
  [[nodiscard]] std::int64_t UtcMicroseconds() const override { return 1'700'000'000'000'000 + now / kMicrosecond; }
  MonoNs now = 1'000 * kSecond;
};

// Carries messages by channel, late, twice or not at all.
class WorldNetwork final : public MessageSink {
 public:
  using Receiver = std::function<void(const std::string& channel, Bytes message)>;

  WorldNetwork(const WorldSettings& settings, const WorldClock& clock, std::mt19937& random)
      : settings_(settings), clock_(clock), random_(random) {}

  void Publish(const std::string& channel, Bytes message) override {
    const int copies = Happens(settings_.duplication) ? 2 : 1;
    for (int copy = 0; copy < copies; ++copy) {
      if (Happens(settings_.loss)) continue;
      const MonoNs delay = std::uniform_int_distribution<int>(0, settings_.max_delay_ms)(random_) * kMillisecond;
      under_way_.push({clock_.Now() + delay, sent_++, channel, {message.begin(), message.end()}});
    }
  }

  void Deliver(const Receiver& receiver) {
    while (!under_way_.empty() && under_way_.top().at <= clock_.Now()) {
      const Datagram datagram = under_way_.top();
      under_way_.pop();
      receiver(datagram.channel, datagram.bytes);
    }
  }

  [[nodiscard]] bool Happens(double share) { return std::bernoulli_distribution(share)(random_); }

 private:
  struct Datagram {
    MonoNs at;
    std::int64_t number;
    std::string channel;
    std::vector<std::uint8_t> bytes;
    bool operator<(const Datagram& other) const {
      return std::pair(at, number) > std::pair(other.at, other.number);
    }
  };

  const WorldSettings& settings_;
  const WorldClock& clock_;
  std::mt19937& random_;
  std::int64_t sent_ = 0;
  std::priority_queue<Datagram> under_way_;
};

// One driver process with its devices. An order touches its device after a while, and is reported later still.
class WorldDriver {
 public:
  WorldDriver(const BusConfig& bus, WorldNetwork& network, WorldClock& clock, std::mt19937& random,
              std::map<CommandId, int>& effects)
      : bus_(bus), network_(network), clock_(clock), random_(random), effects_(effects) {
    Restart();
  }

  // As after kill -9: what was under way may have touched the device or not.
  void Restart() {
    static std::int64_t boots = 100;
    desk_ =
        std::make_unique<OrderDesk>(bus_, UnsignedBridge(), OrderDesk::Context{++boots, &clock_, &network_, [] {}});
    jobs_.clear();
    next_hello_ = clock_.now + kSecond;
  }

  void OnMessage(Bytes message) { desk_->OnDriverCommand(message); }

  void Step() {
    if (clock_.now >= next_hello_) Hello();
    while (auto taken = desk_->Take()) Begin(*taken);
    while (auto cancel = desk_->TakeCancel()) Cancel(*cancel);
    for (auto job = jobs_.begin(); job != jobs_.end();) {
      if (!job->second.touched && clock_.now >= job->second.touch) Touch(job->first, job->second);
      if (clock_.now >= job->second.done) {
        desk_->Report(job->second.device, job->first, job->second.outcome, 0);
        job = jobs_.erase(job);
      } else {
        ++job;
      }
    }
  }

 private:
  struct Job {
    std::string device;
    MonoNs touch = 0;
    MonoNs done = 0;
    bool touched = false;
    Outcome outcome = {};
  };

  void Hello() {
    next_hello_ = clock_.now + kSecond;
    std::vector<OrderDesk::DeviceSummary> devices;
    for (const DeviceConfig& device : bus_.devices) devices.push_back({device.name, 1, 0, false});
    desk_->Hello(devices);
  }

  void Begin(const OrderDesk::Taken& taken) {
    const auto random_ms = [&](int to) {
      return std::uniform_int_distribution<int>(0, to)(random_) * kMillisecond;
    };
    Job job{.device = taken.device, .touch = clock_.now + random_ms(20)};
    job.done = job.touch + random_ms(40);
    if (taken.order.operation == "look" || network_.Happens(0.1)) {
      job.touched = true;  // refuses, or only looks
      const bool looks = taken.order.operation == "look";
      job.outcome.state = looks ? OrderState::kSucceeded : OrderState::kRejected;
    }
    jobs_[taken.order.id] = job;
  }

  void Touch(const CommandId& id, Job& job) {
    job.touched = true;
    const bool works = !network_.Happens(0.1);
    if (works) ++effects_[id];
    job.outcome.state = works ? OrderState::kSucceeded : OrderState::kFailed;
    job.outcome.verified = works;
  }

  void Cancel(const OrderDesk::Taken& cancel) {
    const auto job = jobs_.find(cancel.order.id);
    if (job == jobs_.end() || job->second.touched) return;
    desk_->Report(job->second.device, job->first, {.state = OrderState::kCancelled}, 0);
    jobs_.erase(job);
  }

  const BusConfig& bus_;
  WorldNetwork& network_;
  WorldClock& clock_;
  std::mt19937& random_;
  std::map<CommandId, int>& effects_;
  std::unique_ptr<OrderDesk> desk_;
  std::map<CommandId, Job> jobs_;
  MonoNs next_hello_ = 0;
};

// A client with one command: repeats it until it is answered, asks when it hears nothing.
struct WorldClient {
  command_body_t body{};
  std::vector<std::uint8_t> encoded;
  MonoNs started = 0;
  MonoNs next_send = 0;
  MonoNs cancel_at = kNever;
  bool answered = false;
  std::optional<command_status_t> outcome;
  int outcomes = 0;  // final states that differ from each other, counted
  [[nodiscard]] bool IsDone() const {
    return outcome && (outcome->state != command_status_t::STATE_INDETERMINATE ||
                       outcome->finding != command_status_t::FINDING_NONE);
  }
};

class World {
 public:
  explicit World(WorldSettings settings);

  // Sends `count` commands, two at a time per device, and follows each to its outcome. False when it takes for
  // ever.
  [[nodiscard]] bool Run(std::uint32_t count);

  std::map<CommandId, WorldClient> clients;
  std::map<CommandId, int> effects;  // times that a device was really changed

 private:
  void StartOne(std::uint32_t number);
  void SendDue(WorldClient& client);
  void OnMessage(const std::string& channel, Bytes message);
  void OnStatus(const command_status_t& status);
  void Millisecond();
  [[nodiscard]] Instant Now() const { return {clock_.now, clock_.UtcMicroseconds()}; }

  WorldSettings settings_;
  std::mt19937 random_;
  WorldClock clock_;
  WorldNetwork network_;
  MachineConfig machine_;
  MemoryJournal journal_;
  std::unique_ptr<Dispatcher> bridge_;
  std::map<std::string, std::unique_ptr<WorldDriver>> drivers_;
  std::map<CommandId, WorldClient*> open_;
};

}  // namespace axlecast
