#pragma once

#include <poll.h>
#include <sys/types.h>

#include <cstddef>
#include <string>
#include <vector>

#include "core/messages/broker_link.h"
#include "platform/net/mqtt_link.h"
#include "platform/os/descriptor.h"
#include "tools/mqtt/link_frames.h"

namespace axlecast {

// A connection to a broker in a process of its own, which this program starts again for each attempt: libmosquitto 2.0.11
// ends its process in an assertion when a broker sends a property that it does not know (its property__read logs without
// a client), and takes packets of up to 256 MB. A broker then costs that process, and nothing of what waits here.
class MqttProcess final : public BrokerLink {
 public:
  explicit MqttProcess(MqttLinkSettings settings) : settings_(std::move(settings)), events_in_(kLongestEvent) {}
  ~MqttProcess() override { Drop(); }
  MqttProcess(const MqttProcess&) = delete;
  MqttProcess& operator=(const MqttProcess&) = delete;

  void Connect(const BrokerMessage& will) override;
  void Drop() override;
  void Disconnect() override;
  [[nodiscard]] int Send(const BrokerMessage& message) override;
  [[nodiscard]] std::vector<BrokerEvent> Poll() override;

  // What Poll waits for; fd -1 without a connection.
  [[nodiscard]] pollfd Waiting() const;

 private:
  static constexpr std::size_t kLongestEvent = 1 << 16;

  [[nodiscard]] std::string Start();
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

// The other end: serves one connection on file descriptor 0 until that is closed. An exit code.
[[nodiscard]] int ServeMqttLink();
inline constexpr const char* kMqttLinkOption = "--mqtt-link";

}  // namespace axlecast
