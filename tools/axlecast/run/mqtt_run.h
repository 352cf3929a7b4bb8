#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>

#include "core/config/machine_config.h"
#include "platform/net/lcm_port.h"
#include "platform/os/descriptor.h"
#include "platform/os/process.h"
#include "platform/os/secret_file.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/run/mqtt_process.h"
#include "tools/mqtt/broker_session.h"
#include "tools/mqtt/mqtt_feed.h"
#include "tools/mqtt/mqtt_status.h"

namespace axlecast {

// The machine's messages from LCM's two ports into a sink, until a signal or `end` comes.
class MqttIntake {
 public:
  MqttIntake(const MachineConfig& machine, const Clock& clock, MqttFeed::Sink sink);

  // Empty when messages can come, else the cause and the lines that mend it.
  [[nodiscard]] std::string Open();
  // Calls `each` a few times a second. False when a port failed.
  [[nodiscard]] bool Run(MonoNs end, const std::function<bool()>& each);

  [[nodiscard]] MqttFeed& feed() { return feed_; }
  [[nodiscard]] const MqttFeed& feed() const { return feed_; }
  [[nodiscard]] LcmPort& data() { return data_; }
  // What LCM brought and lost, in a line for people, at most once in 10 s; else empty.
  [[nodiscard]] std::string Lost(MonoNs now);

 private:
  const Clock& clock_;
  LcmPort data_;
  LcmPort command_;
  MqttFeed feed_;
  ReceptionReport reception_;
};

// The bridge to a broker from its start to its end. The calling thread reads from LCM and never waits for the broker, a
// second one carries the outbox to the broker.
class MqttRun {
 public:
  explicit MqttRun(const MachineConfig& machine);

  // Empty when it can begin, else the cause and the remedy.
  [[nodiscard]] std::string Open();
  // Until a signal comes, or `seconds` have passed (0: no end). False when LCM failed.
  [[nodiscard]] bool Run(double seconds);

  [[nodiscard]] MqttStatus status() const;
  [[nodiscard]] std::int64_t boot_id() const { return boot_id_; }

 private:
  void Carry();
  void Tell();
  void TellChanges(const MqttStatus& status);

  const MachineConfig& machine_;
  SystemClock clock_;
  SecretFiles secrets_;
  std::int64_t boot_id_;
  Outbox outbox_;
  MqttIntake intake_;
  MqttProcess link_;
  BrokerSession session_;
  MqttAlarms alarms_;
  Supervision supervision_;
  WakeEvent stop_;
  std::thread carrier_;
  MonoNs next_tell_ = 0;
  std::int64_t told_connections_ = 0;
  std::string told_problem_;
};

// What the link needs of the file.
[[nodiscard]] MqttLinkSettings LinkSettingsOf(const MachineConfig& machine);

}  // namespace axlecast
