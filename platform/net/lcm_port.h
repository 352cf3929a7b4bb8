#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/time.h"
#include "core/messages/machine_filter.h"
#include "core/messages/message.h"

namespace axlecast {

// The LCM datagrams that the ports of a process have received since the start.
struct ReceptionCounts {
  std::int64_t messages = 0;   // complete messages, subscribed or not
  std::int64_t dropped = 0;    // datagrams that the kernel dropped: the process's buffer was full
  std::int64_t outside = 0;    // datagrams of other hosts, refused because the URL has ttl=0, and empty datagrams
  std::int64_t malformed = 0;  // datagrams that are not of LCM
  std::vector<OtherMachine> machines = {};  // other machines whose messages were refused, and are arriving
  std::string network = {};                 // why LCM reaches nobody, or not everyone, at present; empty: it does

  ReceptionCounts& operator+=(const ReceptionCounts& other);
  bool operator==(const ReceptionCounts&) const = default;
};

// Reports losses, refused datagrams, and a network that cannot be used, at most once in 10 s.
class ReceptionReport {
 public:
  static constexpr MonoNs kInterval = 10 * kSecond;

  // Returns true if something was lost or refused since the last line, or the network has changed. Cheap.
  [[nodiscard]] bool Changed(const ReceptionCounts& counts) const {
    return counts.dropped != reported_.dropped || counts.outside != reported_.outside ||
           counts.malformed != reported_.malformed || counts.network != reported_.network ||
           NamesOf(counts.machines) != NamesOf(reported_.machines);
  }

  // Returns a line to log now, or no text. `remedy`: LcmPort::warning().
  [[nodiscard]] std::string NextLine(const ReceptionCounts& counts, MonoNs now, const std::string& remedy = "");

 private:
  ReceptionCounts reported_;
  MonoNs next_ = 0;
};

// Returns "LCM since the start: 3 datagrams lost because …", or no text if nothing was lost or refused.
[[nodiscard]] std::string ReceptionText(const ReceptionCounts& counts, const std::string& remedy);

// Returns "; LCM: this host has no interface eth1 …" behind the error of a command that received no answer; no text if the network can
// be used.
[[nodiscard]] std::string NetworkNote(const ReceptionCounts& counts);

// The only place that touches liblcm. Publishing is thread-safe; subscribing and handling belong to one thread.
//
// udpm:// is sent by GroupSender, because liblcm cannot select an interface and has IPv4 only. It is received by LcmReceiver, because
// liblcm 1.3.1 writes out of bounds for a forged fragment and keeps every channel name for ever. A port that only publishes opens no
// receiving socket. If the URL names an interface that is missing or down, the port works as soon as the interface does. LCM's other
// providers (memq://, tcpq://, file://), which no network reaches, use liblcm.
class LcmPort final : public MessageSink {
 public:
  using Handler = std::function<void(const std::string& channel, Bytes message)>;

  // `prefix` is added to every channel that is published or subscribed, and removed for handlers. With `machine`, a name, messages
  // that state another machine are refused.
  LcmPort(const std::string& url, const std::string& prefix, std::string_view machine = {});
  ~LcmPort() override;
  LcmPort(const LcmPort&) = delete;
  LcmPort& operator=(const LcmPort&) = delete;

  // Returns an empty text if the port works; otherwise the cause and the commands that fix it (no multicast route, malformed
  // URL).
  [[nodiscard]] const std::string& problem() const { return problem_; }

  void Publish(const std::string& channel, Bytes message) override;

  // `channel` is a regular expression (ECMAScript) over the whole channel name (without prefix). Returns false if it is
  // invalid or the port has a problem; problem() may then contain the error of the first subscription. Over udpm:// messages wait in the
  // kernel, in the buffer that the URL's recv_buf_size asks for; with other providers in LCM's queue of `capacity`
  // messages, which drops the newest beyond it.
  bool Subscribe(const std::string& channel, Handler handler, int capacity = 10'000);

  // Calls the handlers for received messages. Waits at most `timeout_ms` for the first message of a subscribed channel. Returns
  // false if the port failed.
  [[nodiscard]] bool Handle(int timeout_ms);
  // Readable when Handle has work. -1 over udpm:// before the first subscription.
  [[nodiscard]] int FileDescriptor() const;

  // Counts of udpm://; with other providers only `machines`. The network's problem is that of receiving, else that of sending.
  // Thread-safe.
  [[nodiscard]] ReceptionCounts received() const;
  // Returns a warning with the commands that fix it if the receive buffer is smaller than requested; otherwise no text.
  [[nodiscard]] std::string warning() const;

  // Messages that could not be sent since the start: the system refused them, or their channel's name is too long.
  [[nodiscard]] std::int64_t unsent() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
  std::string problem_;
};

}  // namespace axlecast
