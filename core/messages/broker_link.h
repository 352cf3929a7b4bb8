#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace axlecast {

// A message for a broker.
struct BrokerMessage {
  std::string topic = {};
  std::string payload = {};
  bool retain = false;  // the broker keeps the newest of the topic for those who come later
  int qos = 1;          // 0 or 1
};

struct BrokerEvent {
  enum class Kind : std::uint8_t {
    kConnected,
    kTaken,     // the broker has `message`, or the subscription; with QoS 0: the host's network has it
    kRefused,   // the broker refuses `message` or the subscription; `text` contains the reason
    kReceived,  // a message of a subscription: `topic`, `text` is its payload
    kDown,      // the connection has ended, or failed; `text` contains the reason
  };
  Kind kind = Kind::kDown;
  int message = 0;  // of BrokerLink::Send
  std::string text = {};
  bool fault = false;  // kDown: the broker broke the protocol or the connection's process; no message is to blame
  std::string topic = {};
  bool retained = false;    // kReceived: it was published before the subscription
  bool taken_over = false;  // kDown: another client with the same id has connected (MQTT 5 only)
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
  // Ends the connection normally. With `publish_will`, an MQTT 5 broker publishes the will; otherwise no broker does.
  virtual void Disconnect(bool publish_will) = 0;

  // Sends a message and returns its number for later events. Call it only while connected.
  [[nodiscard]] virtual int Send(const BrokerMessage& message) = 0;
  // Subscribes to a topic filter with QoS 1 and returns the number of the subscription for later events. A broker handles
  // the packets of a connection in order: when it confirms the subscription, it has every message that was sent before.
  [[nodiscard]] virtual int Subscribe(const std::string& filter) = 0;

  // Processes the connection without waiting, and returns the events since the last call.
  [[nodiscard]] virtual std::vector<BrokerEvent> Poll() = 0;
};

}  // namespace axlecast
