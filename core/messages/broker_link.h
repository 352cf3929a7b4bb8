#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace axlecast {

// A message for a broker.
struct BrokerMessage {
  std::string topic;
  std::string payload;
  bool retain = false;  // the broker keeps the newest of the topic for those who come later
};

struct BrokerEvent {
  enum class Kind : std::uint8_t {
    kConnected,
    kTaken,    // the broker has `message`
    kRefused,  // the broker refuses `message`; `text` contains the reason
    kDown,     // the connection has ended, or failed; `text` contains the reason
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

  // Starts a new connection and discards pending messages. The broker publishes `will` if the connection ends without
  // Disconnect. May block while a name is resolved. kConnected or kDown follows.
  virtual void Connect(const BrokerMessage& will) = 0;
  // Closes the connection without Disconnect.
  virtual void Drop() = 0;
  // Ends the connection normally: the will is not published.
  virtual void Disconnect() = 0;

  // Sends a message and returns its number for later events. Call it only while connected.
  [[nodiscard]] virtual int Send(const BrokerMessage& message) = 0;

  // Processes the connection without waiting, and returns the events since the last call.
  [[nodiscard]] virtual std::vector<BrokerEvent> Poll() = 0;
};

}  // namespace axlecast
