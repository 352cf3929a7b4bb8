#pragma once

#include <poll.h>
#include <sys/types.h>

#include <cstddef>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/messages/broker_link.h"
#include "platform/net/mqtt_link.h"
#include "platform/os/descriptor.h"
#include "tools/mqtt/link_frames.h"

namespace axlecast {

// A connection to a broker in a separate process, which is started for each attempt. Reason: libmosquitto 2.0.11 ends its
// process by an assertion if a broker sends an unknown property (its property__read logs without a client), and it accepts
// packets of up to 256 MB. A broker can then end only that process; the queued messages stay here.
class MqttProcess final : public BrokerLink {
 public:
  explicit MqttProcess(MqttLinkSettings settings) : settings_(std::move(settings)), events_in_(kMaxEventBytes) {}
  ~MqttProcess() override { Drop(); }
  MqttProcess(const MqttProcess&) = delete;
  MqttProcess& operator=(const MqttProcess&) = delete;

  void Connect(const BrokerMessage& will) override;
  void Drop() override;
  void Disconnect(bool publish_will) override;
  [[nodiscard]] int Send(const BrokerMessage& message) override;
  [[nodiscard]] int Subscribe(const std::string& filter) override;
  [[nodiscard]] std::vector<BrokerEvent> Poll() override;

  // Returns what to wait for before Poll; fd -1 without a connection.
  [[nodiscard]] pollfd Waiting() const;

 private:
  static constexpr std::size_t kMaxEventBytes = 1 << 16;

  [[nodiscard]] Result<> Start();
  void SendCommand(const LinkCommand& command);
  void Write();
  void Read();
  void Down(std::string text, bool fault);
  [[nodiscard]] std::string Reap();

  MqttLinkSettings settings_;
  pid_t pid_ = -1;
  Descriptor socket_;
  std::string out_;
  FrameBuffer events_in_;
  std::vector<BrokerEvent> events_;
  int last_id_ = 0;
};

// Runs the separate process: serves one connection on file descriptor 0 until it is closed. Returns the exit code.
[[nodiscard]] int ServeMqttLink();
inline constexpr const char* kMqttLinkOption = "--mqtt-link";

}  // namespace axlecast
