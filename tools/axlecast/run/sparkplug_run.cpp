#include "tools/axlecast/run/sparkplug_run.h"

#include <algorithm>
#include <array>
#include <iostream>
#include <random>
#include <string>

#include "core/messages/json/field.h"
#include "core/messages/message.h"
#include "platform/os/process.h"
#include "platform/os/secret_file.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/run/mqtt_intake.h"
#include "tools/axlecast/run/mqtt_process.h"
#include "tools/mqtt/sparkplug/edge_session.h"
#include "tools/mqtt/sparkplug/sparkplug_status.h"
#include "tools/mqtt/topics.h"

namespace axlecast {
namespace {

constexpr MonoNs kFarewell = 5 * kSecond;          // for NDEATH at the end
constexpr MonoNs kMaxJitter = 500 * kMillisecond;  // before births on request

std::string NodeName(const MachineConfig& machine) {
  return machine.mqtt.sparkplug->node.empty() ? machine.machine : machine.mqtt.sparkplug->node;
}

std::string StateFolder(const MachineConfig& machine) {
  const std::string& directory = machine.mqtt.sparkplug->directory;
  return directory.empty() ? StateDirectory(machine.machine) + "/sparkplug" : directory;
}

MonoNs Jitter() {
  std::random_device random;
  return std::uniform_int_distribution<MonoNs>(0, kMaxJitter)(random);
}

// One thread reads LCM, writes the outbox and serves the broker. It never waits for the broker, which a process of its own serves
// (MqttProcess). It waits for the disk, while LCM's messages wait in the queue of the port.
class SparkplugRun {
 public:
  explicit SparkplugRun(const MachineConfig& machine)
      : machine_(machine),
        origin_(NewOrigin(machine.machine)),
        log_({.folder = StateFolder(machine),
              .max_bytes = machine.mqtt.sparkplug->outbox_bytes,
              .sync_interval = machine.mqtt.sparkplug->sync,
              .repeat_us = machine.mqtt.sparkplug->repeat / kMicrosecond}),
        birth_sequence_(StateFolder(machine) + "/bdseq"),
        node_(
            machine,
            SparkplugTopics(machine.mqtt.sparkplug->group, NodeName(machine), machine.mqtt.sparkplug->primary_host),
            AXLECAST_VERSION, clock_.Now()),
        link_(LinkSettingsOf(machine)),
        session_(link_, log_, node_, birth_sequence_, Jitter),
        intake_(
            machine, clock_,
            [this](std::string_view channel, Bytes message) { session_.OnSample(channel, message, Now()); },
            [this](const std::string& channel) { node_.OnHeard(channel, clock_.Now()); }),
        alarms_(MqttAlarmName(machine), origin_, clock_.Now()) {}

  [[nodiscard]] Result<> Open() {
    SecretFiles secrets;
    if (Result<> usable = CheckMqttCredentials(LinkSettingsOf(machine_), secrets); !usable) return usable;
    if (Result<> opened = log_.Open(); !opened) return opened;
    return intake_.Open();
  }

  // Runs until a signal, or for `seconds` (0: no limit). Fails if LCM fails, or if another client has the same id.
  [[nodiscard]] Result<> Run(double seconds) {
    const StopSignal stop;
    supervision_.Ready();
    Result<> done = intake_.Run(
        seconds,
        [this, &stop] {
          static_cast<void>(session_.Step(Now()));
          supervision_.Progress(clock_.Now());
          ReportEachSecond();
          return !stop.Requested() && !session_.ended();
        },
        [this] { return link_.Waiting(); });
    supervision_.Stopping();
    End();
    if (!session_.failure().empty()) return Failure(session_.failure());
    return done;
  }

  [[nodiscard]] SparkplugStatus status() const {
    return {.feed = intake_.feed().counts(),
            .broker = session_.status(),
            .edge = session_.counts(),
            .log = log_.counts(),
            .born = session_.born(),
            .waits_for_host = session_.waits_for_host(),
            .caught_up = caught_up_,
            .unknown = node_.unknown()};
  }

 private:
  [[nodiscard]] Timestamp Now() const { return {clock_.Now(), clock_.UtcMicroseconds()}; }

  void End() {
    caught_up_ = session_.caught_up();
    const MonoNs deadline = clock_.Now() + kFarewell;
    if (!session_.ended()) session_.End(Now());
    while (!session_.ended() && clock_.Now() < deadline) {
      const MonoNs next = session_.Step(Now());
      std::array<pollfd, 1> files = {link_.Waiting()};
      static_cast<void>(PollUntil(files, std::min(next, deadline), clock_));
    }
    log_.Close(clock_.UtcMicroseconds());
  }

  void ReportEachSecond() {
    const MonoNs now = clock_.Now();
    if (now < next_report_) return;
    next_report_ = now + kSecond;
    caught_up_ = session_.caught_up();
    const SparkplugStatus status = this->status();
    intake_.ReportLosses(now);
    static_cast<void>(Publish(intake_.data(), "ALARM/" + MqttAlarmName(machine_),
                              alarms_.Make(status.ForAlarms(), now, clock_.UtcMicroseconds())));
    supervision_.Status(SparkplugStatusLine(status));
    ReportChanges(status);
  }

  void ReportChanges(const SparkplugStatus& status) {
    const std::string broker = BrokerText(machine_.mqtt) + ": ";
    if (status.broker.connections != reported_.broker.connections) std::cerr << broker << "connected\n";
    if (status.edge.host_waits != reported_.edge.host_waits) std::cerr << broker << "waits for the primary host\n";
    if (status.born && status.edge.births != reported_.edge.births) std::cerr << broker << "births sent\n";
    if (!status.broker.problem.empty() && status.broker.problem != reported_.broker.problem) {
      std::cerr << broker << status.broker.problem << '\n';
    }
    for (const auto& [problem, reported] :
         {std::pair(&log_.problem(), &log_problem_), std::pair(&birth_sequence_.problem(), &birth_problem_)}) {
      if (!problem->empty() && *problem != *reported) std::cerr << *problem << '\n';
      *reported = *problem;
    }
    reported_ = status;
  }

  const MachineConfig& machine_;
  SystemClock clock_;
  Origin origin_;
  SampleLog log_;
  BirthSequence birth_sequence_;
  EdgeNode node_;
  MqttProcess link_;
  EdgeSession session_;
  MqttIntake intake_;
  MqttAlarms alarms_;
  Supervision supervision_;
  MonoNs next_report_ = 0;
  bool caught_up_ = false;
  SparkplugStatus reported_;
  std::string log_problem_;
  std::string birth_problem_;
};

}  // namespace

int RunSparkplug(const MachineConfig& machine, double seconds, bool as_json) {
  SparkplugRun run(machine);
  if (const Result<> opened = run.Open(); !opened) return Fail(opened.error().text, kExitFailed);
  std::cerr << "machine " << machine.machine << " to " << BrokerText(machine.mqtt) << " as Sparkplug node "
            << machine.mqtt.sparkplug->group << '/' << NodeName(machine) << "; Ctrl-C ends it\n";
  const Result<> done = run.Run(seconds);
  const SparkplugStatus status = run.status();
  if (as_json) {
    static_cast<void>(WriteOut(JsonLine(SparkplugStatusJson(status)) + '\n'));
  } else {
    std::cerr << SparkplugStatusLine(status) << '\n';
  }
  if (!done) return Fail(done.error().text, kExitFailed);
  return status.Lost() > 0 ? kExitLosses : kExitDone;
}

}  // namespace axlecast
