#include "tools/axlecast/run/mqtt_intake.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <utility>

#include "platform/os/system_clock.h"
#include "tools/mqtt/topics.h"

namespace axlecast {
namespace {

constexpr int kQueue = 50'000;  // messages of a few seconds, while this process gets no processor time
constexpr MonoNs kPollPeriod = 50 * kMillisecond;
constexpr int kSparkplugKeepAlive = 10;  // s; a host believes a dead node alive for 1.5 times as long

}  // namespace

MqttLinkSettings LinkSettingsOf(const MachineConfig& machine) {
  const MqttConfig& mqtt = machine.mqtt;
  MqttLinkSettings settings;
  settings.host = mqtt.host;
  settings.port = static_cast<int>(PortOf(mqtt));
  settings.version_5 = mqtt.version_5;
  settings.client_id = mqtt.client_id.empty() ? "axlecast-" + machine.machine : mqtt.client_id;
  settings.user = mqtt.user;
  settings.password = mqtt.password;
  settings.tls = mqtt.tls.has_value();
  if (mqtt.tls) {
    settings.ca = mqtt.tls->ca;
    settings.certificate = mqtt.tls->certificate;
    settings.key = mqtt.tls->key;
  }
  if (mqtt.sparkplug) settings.keep_alive_s = kSparkplugKeepAlive;
  return settings;
}

MqttIntake::MqttIntake(const MachineConfig& machine, const Clock& clock, MqttFeed::Sink sink)
    : clock_(clock),
      data_(machine.lcm.url, machine.lcm.prefix, machine.machine),
      command_(machine.lcm.command_url, machine.lcm.prefix, machine.machine),
      feed_(machine, std::move(sink)) {}

MqttIntake::MqttIntake(const MachineConfig& machine, const Clock& clock, MqttFeed::MessageSink sink,
                       std::function<void(const std::string& channel)> on_heard)
    : clock_(clock),
      data_(machine.lcm.url, machine.lcm.prefix, machine.machine),
      command_(machine.lcm.command_url, machine.lcm.prefix, machine.machine),
      feed_(machine, std::move(sink)),
      on_heard_(std::move(on_heard)) {}

Result<> MqttIntake::Open() {
  for (const LcmPort* port : {&data_, &command_}) {
    if (!port->problem().empty()) return Failure(port->problem());
  }
  const auto on_data = [this](const std::string& channel, Bytes message) {
    on_heard_(channel);
    feed_.OnData(channel, message, clock_.Now());
  };
  const auto on_status = [this](const std::string&, Bytes message) {
    feed_.OnCommandStatus(message, clock_.Now());
  };
  if (data_.Subscribe(MqttDataChannels(), on_data, kQueue) &&
      command_.Subscribe(kMqttCommandChannels, on_status, kQueue)) {
    return {};
  }
  return Failure("cannot subscribe on LCM");
}

Result<> MqttIntake::Run(double seconds, const std::function<bool()>& proceed,
                         const std::function<pollfd()>& link) {
  const MonoNs end = seconds > 0 ? clock_.Now() + static_cast<MonoNs>(std::llround(seconds * 1e9)) : kNever;
  std::array<pollfd, 3> sources = {
      {{data_.FileDescriptor(), POLLIN, 0}, {command_.FileDescriptor(), POLLIN, 0}, {-1, 0, 0}}};
  while (proceed()) {
    const MonoNs now = clock_.Now();
    if (now >= end) break;
    feed_.Poll(now);
    if (link) sources[2] = link();
    static_cast<void>(PollUntil(sources, std::min(end, now + kPollPeriod), clock_));
    if (!data_.Handle(0) || !command_.Handle(0)) return Failure("the LCM port failed");
  }
  feed_.Flush();
  return {};
}

void MqttIntake::ReportLosses(MonoNs now) {
  ReceptionCounts counts = data_.received();
  counts += command_.received();
  const std::string line = reception_.NextLine(counts, now, data_.warning());
  if (!line.empty()) std::cerr << line << '\n';
}

}  // namespace axlecast
