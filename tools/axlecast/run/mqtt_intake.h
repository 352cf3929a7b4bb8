#pragma once

#include <poll.h>

#include <functional>

#include "core/base/result.h"
#include "core/config/machine_config.h"
#include "platform/net/lcm_port.h"
#include "platform/net/mqtt_link.h"
#include "tools/mqtt/mqtt_feed.h"

namespace axlecast {

[[nodiscard]] MqttLinkSettings LinkSettingsOf(const MachineConfig& machine);

// Passes the machine's messages from both LCM ports to a feed, which selects those to publish. One thread.
class MqttIntake {
 public:
  // `sink`: of the feed.
  MqttIntake(const MachineConfig& machine, const Clock& clock, MqttFeed::Sink sink);
  // `on_heard`: is called before the feed, with the channel of every message.
  MqttIntake(const MachineConfig& machine, const Clock& clock, MqttFeed::MessageSink sink,
             std::function<void(const std::string& channel)> on_heard);

  [[nodiscard]] Result<> Open();

  // Calls `proceed` at least 20 times per second, and when `link` returns a descriptor that is ready. Returns when `proceed`
  // returns false, or after `seconds` (0: no limit). Fails if a port fails.
  [[nodiscard]] Result<> Run(double seconds, const std::function<bool()>& proceed,
                             const std::function<pollfd()>& link = {});

  // Prints the messages that LCM lost or refused, at most once in 10 s.
  void ReportLosses(MonoNs now);

  [[nodiscard]] MqttFeed& feed() { return feed_; }
  [[nodiscard]] const MqttFeed& feed() const { return feed_; }
  [[nodiscard]] LcmPort& data() { return data_; }

 private:
  const Clock& clock_;
  LcmPort data_;
  LcmPort command_;
  MqttFeed feed_;
  std::function<void(const std::string& channel)> on_heard_ = [](const std::string&) {};
  ReceptionReport reception_;
};

}  // namespace axlecast
