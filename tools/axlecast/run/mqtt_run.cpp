#include "tools/axlecast/run/mqtt_run.h"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <utility>

#include "core/base/result.h"
#include "core/messages/json/field.h"
#include "core/messages/message.h"
#include "platform/os/system_clock.h"

namespace axlecast {
namespace {

constexpr int kQueue = 50'000;  // messages: those of some seconds, while this process gets no time
constexpr MonoNs kTurn = 50 * kMillisecond;
constexpr MonoNs kFarewell = 5 * kSecond;  // to deliver what still waits at the end

Outbox::Limits LimitsOf(const MqttConfig& mqtt) {
  return {static_cast<std::size_t>(mqtt.queue_messages), static_cast<std::size_t>(mqtt.queue_bytes)};
}

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
  return settings;
}

MqttIntake::MqttIntake(const MachineConfig& machine, const Clock& clock, MqttFeed::Sink sink)
    : clock_(clock),
      data_(machine.lcm.url, machine.lcm.prefix),
      command_(machine.lcm.command_url, machine.lcm.prefix),
      feed_(machine, std::move(sink)) {}

std::string MqttIntake::Open() {
  for (const LcmPort* port : {&data_, &command_}) {
    if (!port->problem().empty()) return port->problem();
  }
  const auto data = [this](const std::string& channel, Bytes message) {
    feed_.OnData(channel, message, clock_.Now());
  };
  const auto command = [this](const std::string&, Bytes message) { feed_.OnCommandStatus(message, clock_.Now()); };
  const bool hears = data_.Subscribe(MqttDataChannels(), data, kQueue) &&
                     command_.Subscribe(kMqttCommandChannels, command, kQueue);
  return hears ? "" : "cannot subscribe on LCM";
}

bool MqttIntake::Run(MonoNs end, const std::function<bool()>& each) {
  std::array<pollfd, 2> sources = {{{data_.FileDescriptor(), POLLIN, 0}, {command_.FileDescriptor(), POLLIN, 0}}};
  while (each()) {
    const MonoNs now = clock_.Now();
    if (now >= end) break;
    feed_.Poll(now);
    static_cast<void>(PollUntil(sources, std::min(end, now + kTurn), clock_));
    if (!data_.Handle(0) || !command_.Handle(0)) return false;
  }
  feed_.Flush();
  return true;
}

std::string MqttIntake::Lost(MonoNs now) {
  ReceptionCounts counts = data_.received();
  counts += command_.received();
  return reception_.NextLine(counts, now, data_.warning());
}

MqttRun::MqttRun(const MachineConfig& machine)
    : machine_(machine),
      boot_id_(RandomBootId()),
      outbox_(LimitsOf(machine.mqtt)),
      intake_(machine, clock_,
              [this](BrokerMessage message, RetentionClass keeping) { outbox_.Put(std::move(message), keeping); }),
      link_(LinkSettingsOf(machine)),
      session_(
          link_, outbox_,
          {intake_.feed().topics().status(), JsonLine(MqttStatusJson("offline", boot_id_)),
           [this] { return JsonLine(MqttStatusJson("online", boot_id_, clock_.UtcMicroseconds(), status())); },
           [this] { return JsonLine(MqttStatusJson("ended", boot_id_, clock_.UtcMicroseconds(), status())); }}),
      alarms_(MqttAlarmName(machine), boot_id_, clock_.Now()) {}

std::string MqttRun::Open() {
  if (const Result<> done = CheckMqttCredentials(LinkSettingsOf(machine_), secrets_); !done)
    return done.error().text;
  return intake_.Open();
}

bool MqttRun::Run(double seconds) {
  const StopSignal stop;
  carrier_ = std::thread([this] { Carry(); });
  supervision_.Ready();
  const MonoNs end = seconds > 0 ? clock_.Now() + static_cast<MonoNs>(std::llround(seconds * 1e9)) : kNever;
  const bool good = intake_.Run(end, [this, &stop] {
    supervision_.Progress(clock_.Now());
    Tell();
    return !stop.Requested();
  });
  supervision_.Stopping();
  stop_.Set();
  carrier_.join();
  return good;
}

void MqttRun::Carry() {
  bool ending = false;
  while (!session_.ended()) {
    const MonoNs next = session_.Step(clock_.Now());
    std::array<pollfd, 3> files = {
        {link_.Waiting(), {stop_.FileDescriptor(), POLLIN, 0}, {outbox_.FileDescriptor(), POLLIN, 0}}};
    if (ending) files[1].fd = -1;
    if (!session_.WantsMore()) files[2].fd = -1;
    static_cast<void>(PollUntil(files, std::min(next, clock_.Now() + kSecond), clock_));
    if (!ending && (files[1].revents & POLLIN) != 0) {
      ending = true;
      session_.End(clock_.Now() + kFarewell);
    }
  }
}

// Once a second.
void MqttRun::Tell() {
  const MonoNs now = clock_.Now();
  if (now < next_tell_) return;
  next_tell_ = now + kSecond;
  const MqttStatus status = this->status();
  if (const std::string lost = intake_.Lost(now); !lost.empty()) std::cerr << lost << '\n';
  static_cast<void>(Publish(intake_.data(), "ALARM/" + MqttAlarmName(machine_),
                            alarms_.Make(status, now, clock_.UtcMicroseconds())));
  supervision_.Status(MqttStatusLine(status));
  TellChanges(status);
}

void MqttRun::TellChanges(const MqttStatus& status) {
  const BrokerStatus& broker = status.broker;
  if (broker.connections != told_connections_) std::cerr << BrokerText(machine_.mqtt) << ": connected\n";
  const bool news = broker.problem != told_problem_ || broker.connections != told_connections_;
  if (!broker.problem.empty() && news) std::cerr << BrokerText(machine_.mqtt) << ": " << broker.problem << '\n';
  if (broker.connections != told_connections_ && told_connections_ > 0) intake_.feed().RepublishStates();
  told_connections_ = broker.connections;
  told_problem_ = broker.problem;
}

MqttStatus MqttRun::status() const {
  return {.feed = intake_.feed().counts(), .outbox = outbox_.counts(), .broker = session_.status()};
}

}  // namespace axlecast
