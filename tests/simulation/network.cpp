#include "tests/simulation/network.h"

#include <algorithm>

namespace axlecast::simulation {
namespace {

constexpr MonoNs kShortest = 20 * kMicrosecond;
constexpr MonoNs kQueue = 50 * kMicrosecond;  // mean
constexpr MonoNs kStraggler = 5 * kSecond;    // at most

}  // namespace

int Network::Join(const Host& host, Port port, Handler handler) {
  members_.emplace(count_, Member{&host, port, std::make_shared<const Handler>(std::move(handler))});
  return count_++;
}

std::vector<MonoNs> Network::Delays(const Host& from, const Host& to) {
  const bool crosses = &from != &to;
  if (crosses && faults.parted) return {};
  std::vector<MonoNs> delays;
  const int copies = random_.Happens(faults.duplication) ? 2 : 1;
  for (int copy = 0; copy < copies; ++copy) {
    if (random_.Happens(faults.loss)) continue;
    MonoNs delay = kShortest + random_.Delay(kQueue) + random_.Time(0, faults.max_delay);
    if (random_.Happens(faults.stragglers)) delay += random_.Time(0, kStraggler);
    if (crosses && from.name < to.name) delay += faults.asymmetry;
    delays.push_back(delay);
  }
  return delays;
}

void Network::Send(const Host& from, Port port, const std::string& channel, Bytes message) {
  ++sent_;
  std::vector<const Host*> hosts;  // with a receiver
  for (const auto& [number, member] : members_) {
    if (member.port == port && std::find(hosts.begin(), hosts.end(), member.host) == hosts.end())
      hosts.push_back(member.host);
  }
  for (const Host* to : hosts) {
    for (const MonoNs delay : Delays(from, *to)) {
      schedule_.After(delay,
                      [this, to, port, channel, bytes = std::vector<std::uint8_t>(message.begin(), message.end())] {
                        Deliver(*to, port, channel, bytes);
                      });
    }
  }
}

void Network::Deliver(const Host& to, Port port, const std::string& channel, Bytes message) {
  // A handler may end or begin processes.
  std::vector<int> numbers;
  for (const auto& [number, member] : members_) {
    if (member.host == &to && member.port == port) numbers.push_back(number);
  }
  for (const int number : numbers) {
    const auto found = members_.find(number);
    if (found == members_.end()) continue;
    const std::shared_ptr<const Handler> handler = found->second.handler;
    (*handler)(channel, message);
  }
}

void Network::SendTo(const Host& from, const Host& to, std::function<void()> arrive) {
  for (const MonoNs delay : Delays(from, to)) schedule_.After(delay, arrive);
}

}  // namespace axlecast::simulation
