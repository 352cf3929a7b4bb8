#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "client/axis/priority_mutex.h"
#include "client/axlecast/axis.h"
#include "core/messages/message.h"
#include "platform/net/lcm_port.h"
#include "platform/os/descriptor.h"
#include "platform/os/system_clock.h"

namespace axlecast {
inline namespace control {

// Receives the messages of one device or set. The mutex of the connection is locked in every call.
class Receiver {
 public:
  Receiver() = default;
  Receiver(const Receiver&) = delete;
  Receiver& operator=(const Receiver&) = delete;
  virtual ~Receiver() = default;

  // `channel` is that of the message, without prefix. Messages of other devices come too.
  virtual void On(const std::string& channel, Bytes message, std::int64_t now_ns) = 0;
};

// What the axes and sets of a connection have in common.
struct Connection::State {
  explicit State(const ConnectionSettings& settings);
  ~State() { Stop(); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  void Start();
  void Stop();
  void Run();
  void Add(Receiver& receiver);
  void Remove(Receiver& receiver);

  const SystemClock clock;
  const std::int64_t machine_id;
  LcmPort port;
  const WakeEvent wake;
  Result<> usable;
  std::atomic<bool> stopping = false;
  std::atomic<bool> failed = false;
  std::thread thread;
  std::optional<CommandClient> commands;
  std::optional<PermitIssuer> permits;

  mutable PriorityMutex mutex;  // of the next two, and of every receiver
  TimeBase time;
  std::vector<Receiver*> receivers;
};

}  // namespace control
}  // namespace axlecast
