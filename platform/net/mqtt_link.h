#pragma once

#include <poll.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/base/secret.h"
#include "core/messages/broker_link.h"

namespace axlecast {

struct MqttLinkSettings {
  std::string host;
  int port = 1883;
  bool version_5 = true;  // else 3.1.1
  std::string client_id;
  std::string user;      // empty: none
  SecretPlace password;  // read at each Connect
  bool tls = false;
  std::string ca;  // PEM files; if empty: the certificates of the system, none, none
  std::string certificate;
  std::string key;
  int keep_alive_s = 15;  // a broker that is silent for twice as long is down
  std::uint32_t attempts =
      0;  // before this one, that did not end in a connection: they choose among a name's addresses
};

// The longest payload that is received; a longer one arrives as an empty one.
inline constexpr std::size_t kLongestReceived = 16 << 10;

// The only place that uses libmosquitto. A broker can crash the process that uses this class, so
// tools/axlecast/run/mqtt_process.h runs it in a separate process.
class MqttLink final : public BrokerLink {
 public:
  MqttLink(MqttLinkSettings settings, SecretSource& secrets);
  ~MqttLink() override;
  MqttLink(const MqttLink&) = delete;
  MqttLink& operator=(const MqttLink&) = delete;

  void Connect(const BrokerMessage& will) override;
  void Drop() override;
  void Disconnect(bool publish_will) override;
  [[nodiscard]] int Send(const BrokerMessage& message) override;
  [[nodiscard]] int Subscribe(const std::string& filter) override;
  [[nodiscard]] std::vector<BrokerEvent> Poll() override;

  // Returns what to wait for before Poll; fd -1 without a connection.
  [[nodiscard]] pollfd Waiting() const;

 private:
  struct Client;

  [[nodiscard]] Result<> Prepare(const BrokerMessage& will);
  [[nodiscard]] const char* NextFamily();
  void Check(int result);
  void Down(std::string text, bool fault = false, bool taken_over = false);

  MqttLinkSettings settings_;
  SecretSource& secrets_;
  std::unique_ptr<Client> client_;
  std::vector<BrokerEvent> events_;
  bool down_ = true;
  int refused_ = 0;  // counts downwards: numbers of messages that were not sent
};

// Fails if a file or the password of the settings cannot be used.
[[nodiscard]] Result<> CheckMqttCredentials(const MqttLinkSettings& settings, SecretSource& secrets);

}  // namespace axlecast
