#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/messages/message.h"
#include "tests/simulation/host.h"
#include "tests/simulation/schedule.h"

namespace axlecast::simulation {

// The two multicast ports of a machine.
enum class Port : std::uint8_t { kData, kCommands };

// What the network does to messages.
struct NetworkFaults {
  double loss = 0;         // share
  double duplication = 0;  // share
  MonoNs max_delay = 0;    // evenly spread: reorders
  double stragglers = 0;   // share that is delayed by up to 5 s
  bool parted = false;     // nothing passes from one host to another
  MonoNs asymmetry = 0;    // delay of one direction between hosts in addition
};

// Carries messages from each process to the processes of all hosts.
class Network {
 public:
  using Handler = std::function<void(const std::string& channel, Bytes message)>;

  Network(Schedule& schedule, std::uint64_t seed) : schedule_(schedule), random_(seed, 77) {}

  // Returns a number for Leave.
  int Join(const Host& host, Port port, Handler handler);
  void Leave(int number) { members_.erase(number); }
  void Send(const Host& from, Port port, const std::string& channel, Bytes message);
  // One datagram from host to host: runs `arrive` when it arrives, if it does.
  void SendTo(const Host& from, const Host& to, std::function<void()> arrive);

  NetworkFaults faults;
  [[nodiscard]] std::int64_t sent() const { return sent_; }

 private:
  struct Member {
    const Host* host;
    Port port;
    std::shared_ptr<const Handler> handler;  // it may end its own process
  };

  // Nothing: it is lost.
  [[nodiscard]] std::vector<MonoNs> Delays(const Host& from, const Host& to);
  void Deliver(const Host& to, Port port, const std::string& channel, Bytes message);

  Schedule& schedule_;
  Random random_;
  std::map<int, Member> members_;
  int count_ = 0;
  std::int64_t sent_ = 0;
};

// What a process of a host publishes on one port.
class HostPort final : public MessageSink {
 public:
  // `seen` is called for each message before it is sent; may be empty.
  HostPort(Network& network, const Host& host, Port port, Network::Handler seen = {})
      : network_(network), host_(host), port_(port), seen_(std::move(seen)) {}

  void Publish(const std::string& channel, Bytes message) override {
    if (seen_) seen_(channel, message);
    network_.Send(host_, port_, channel, message);
  }

 private:
  Network& network_;
  const Host& host_;
  const Port port_;
  const Network::Handler seen_;
};

}  // namespace axlecast::simulation
