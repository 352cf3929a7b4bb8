#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "core/messages/message.h"
#include "platform/net/reception_report.h"

namespace axlecast {

// The only place that touches liblcm. Publishing is thread-safe; subscribing and handling belong to one thread.
//
// udpm:// is sent by liblcm but received by LcmReceiver, because liblcm 1.3.1 writes out of bounds for a forged fragment and
// keeps every channel name for ever. A port that only publishes opens no receiving socket. LCM's other providers (memq://,
// tcpq://, file://), which no network reaches, are received by liblcm.
class LcmPort final : public MessageSink {
 public:
  using Handler = std::function<void(const std::string& channel, Bytes message)>;

  // `prefix` is put before every channel that is published or subscribed, and taken off again for handlers.
  LcmPort(const std::string& url, const std::string& prefix);
  ~LcmPort() override;
  LcmPort(const LcmPort&) = delete;
  LcmPort& operator=(const LcmPort&) = delete;

  // Empty when the port works, else the cause and the lines that mend it (no multicast route, malformed URL).
  [[nodiscard]] const std::string& problem() const { return problem_; }

  void Publish(const std::string& channel, Bytes message) override;

  // `channel` is a regular expression (ECMAScript) over the whole channel name (without prefix). False when it is none, or
  // the port has a problem; problem() then may name what the first subscription met. Over udpm:// messages wait in the
  // kernel, in the buffer that the URL's recv_buf_size asks for; with other providers in LCM's queue of `capacity`
  // messages, which drops the newest beyond it.
  bool Subscribe(const std::string& channel, Handler handler, int capacity = 10'000);

  // Calls handlers for what has come; waits at most `timeout_ms` for the first message of a subscribed channel. False when
  // the port failed.
  [[nodiscard]] bool Handle(int timeout_ms);
  // Readable when Handle has work. -1 over udpm:// before the first subscription.
  [[nodiscard]] int FileDescriptor() const;

  // What was received over udpm://, what the kernel dropped and what was refused; thread-safe. Zero with other providers.
  [[nodiscard]] ReceptionCounts received() const;
  // Empty, or: the receive buffer is smaller than asked for, and what mends that.
  [[nodiscard]] std::string warning() const;

  // Messages that could not be sent since the start: the system refused them, or their channel's name is too long.
  [[nodiscard]] std::int64_t unsent() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
  std::string problem_;
};

}  // namespace axlecast
