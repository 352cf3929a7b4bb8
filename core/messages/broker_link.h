#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace axlecast {

// What a broker of messages is given.
struct BrokerMessage {
  std::string topic;
  std::string payload;
  bool retain = false;  // the broker keeps the newest of the topic for those who come later
};

struct BrokerEvent {
  enum class Kind : std::uint8_t {
    kConnected,
    kTaken,    // the broker has `message`
    kRefused,  // the broker does not take `message`: `text` says why
    kDown,     // there is no connection any more, or there will be none: `text` says why
  };
  Kind kind = Kind::kDown;
  int message = 0;  // of BrokerLink::Send
  std::string text = {};
  bool fault = false;  // kDown: the broker broke the protocol or the connection's process; no message is to blame
};

// A connection to a broker. platform/net/mqtt_link.h is the real one. One thread.
class BrokerLink {
 public:
  virtual ~BrokerLink() = default;

  // Begins anew; what was under way is forgotten. The broker will publish `will` when the connection ends without
  // Disconnect. May take as long as the resolution of a name does; kConnected or kDown follows.
  virtual void Connect(const BrokerMessage& will) = 0;
  // Drops the connection without a word.
  virtual void Drop() = 0;
  // Ends it orderly: the will is not published.
  virtual void Disconnect() = 0;

  // The number under which events speak of the message; an event may tell at once that it is refused. Only while
  // connected.
  [[nodiscard]] virtual int Send(const BrokerMessage& message) = 0;

  // Does what is due, without waiting, and tells what has happened since the call before.
  [[nodiscard]] virtual std::vector<BrokerEvent> Poll() = 0;
};

}  // namespace axlecast
