#pragma once

#include <cstdint>
#include <functional>
#include <queue>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/base/time.h"
#include "core/messages/message.h"

namespace axlecast {

class WorldClock final : public Clock {
 public:
  [[nodiscard]] MonoNs Now() const override { return now; }
  [[nodiscard]] std::int64_t UtcMicroseconds() const override { return 1'700'000'000'000'000 + now / kMicrosecond; }
  MonoNs now = 1'000 * kSecond;
};

struct NetworkSettings {
  double loss = 0;         // of any message
  double duplication = 0;  // of any message
  int max_delay_ms = 0;    // evenly spread: reorders
};

// Carries messages by channel, late, twice or not at all.
class WorldNetwork final : public MessageSink {
 public:
  using Receiver = std::function<void(const std::string& channel, Bytes message)>;

  WorldNetwork(const NetworkSettings& settings, const WorldClock& clock, std::mt19937& random)
      : settings_(settings), clock_(clock), random_(random) {}

  // Receives every message that is sent, also one that is lost.
  std::function<void(const std::string& channel, Bytes message)> on_sent;

  void Publish(const std::string& channel, Bytes message) override {
    if (on_sent) on_sent(channel, message);
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

  [[nodiscard]] bool Happens(double share) { return share > 0 && std::bernoulli_distribution(share)(random_); }

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

  const NetworkSettings settings_;
  const WorldClock& clock_;
  std::mt19937& random_;
  std::int64_t sent_ = 0;
  std::priority_queue<Datagram> under_way_;
};

}  // namespace axlecast
