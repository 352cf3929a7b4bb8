#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "drivers/runtime/core/message_sink.h"

namespace axlecast {

// The only place that touches LCM. Publishing is thread-safe; subscribing and handling belong to one thread.
class LcmPort final : public MessageSink {
 public:
  using Handler = std::function<void(const std::string& channel, Bytes message)>;

  // `prefix` is put before every channel that is published or subscribed, and taken off again for handlers.
  LcmPort(const std::string& url, std::string prefix);
  ~LcmPort() override;
  LcmPort(const LcmPort&) = delete;
  LcmPort& operator=(const LcmPort&) = delete;

  // Empty when the port works, else the cause and the lines that mend it (no multicast route, malformed URL).
  [[nodiscard]] const std::string& problem() const { return problem_; }

  void Publish(const std::string& channel, Bytes message) override;

  // `channel` is a regular expression (ECMAScript) over the whole channel name (without prefix). The queue holds
  // `capacity` messages: LCM drops the newest beyond it. False when it is no regular expression, or the port has a
  // problem.
  bool Subscribe(const std::string& channel, Handler handler, int capacity = 10'000);

  // Calls handlers for what has come; waits at most `timeout_ms`. False when the port failed.
  [[nodiscard]] bool Handle(int timeout_ms);
  [[nodiscard]] int FileDescriptor() const;  // readable when Handle has work

  // Messages that could not be sent since the start: the system refused them, or their channel's name is too long.
  [[nodiscard]] std::int64_t unsent() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
  std::string problem_;
};

// Sends itself a datagram over the URL's group and port and waits up to 1 s for it. Empty when it came, else the
// cause and the lines that mend it. `axlecast up` asks before it starts anything.
[[nodiscard]] std::string MulticastProblem(const std::string& url);

}  // namespace axlecast
