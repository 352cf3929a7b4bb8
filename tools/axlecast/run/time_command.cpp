#include <poll.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <axlecast/time_quality_t.hpp>
#include <cmath>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "core/base/result.h"
#include "core/base/spelling.h"
#include "core/base/text.h"
#include "core/config/machine_config.h"
#include "core/messages/json/field.h"
#include "core/messages/json/message_json.h"
#include "core/messages/message.h"
#include "core/time/time_keeper.h"
#include "core/time/time_packet.h"
#include "core/time/utc_claim.h"
#include "platform/net/chrony_port.h"
#include "platform/net/lcm_port.h"
#include "platform/net/time_port.h"
#include "platform/os/process.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/program.h"
#include "tools/axlecast/common/subcommands.h"
#include "tools/axlecast/common/terminal.h"

namespace axlecast {
namespace {

using Q = time_quality_t;

constexpr MonoNs kCycle = 100 * kMillisecond;

// Returns the claim in one line: "synchronised with plc1, +-0.312 ms".
std::string ClaimText(const time_quality_t& quality) {
  if (quality.half_width_ns < 0) return "no claim: " + quality.reason;
  const std::string width = Text("+-%.3f ms", static_cast<double>(quality.half_width_ns) * 1e-6);
  if (quality.source == Q::SOURCE_SELF) return "is the root of the time base";
  return (quality.state == Q::STATE_HOLDOVER ? "was synchronised with " : "synchronised with ") + quality.root +
         ", " + width;
}

// One end of the time base: answers or asks, and publishes TIME/<host>.
class TimeService {
 public:
  TimeService(const MachineConfig& machine, std::string host)
      : time_(machine.time),
        host_(std::move(host)),
        origin_(NewOrigin(machine.machine)),
        messages_(machine.lcm.url, machine.lcm.prefix, machine.machine),
        to_drivers_(machine.lcm.command_url, machine.lcm.prefix, machine.machine),
        keeper_({.max_rate_ppb = machine.time.max_rate_ppm * 1'000LL,
                 .max_slew_ppb = machine.time.max_slew_ppm * 1'000LL},
                IsRoot() ? BaseId() : 0),
        virtual_machine_(IsVirtualMachine()) {}

  [[nodiscard]] Result<> Open() {
    for (const LcmPort* port : {&messages_, &to_drivers_}) {
      if (!port->problem().empty()) return Failure(port->problem());
    }
    if (origin_.clock_id == 0)
      return Failure("cannot read /proc/sys/kernel/random/boot_id, which identifies the clock of this host");
    Result<TimePort> port =
        IsRoot() ? TimePort::Listen(time_.address, time_.port) : TimePort::Connect(time_.address, time_.port);
    if (!port) return Failure(port.error());
    port_.emplace(std::move(*port));
    return {};
  }

  // Runs until a signal, or for `seconds` (0: no limit). Calls `report` with each claim that differs in kind from the one before.
  template <typename Report>
  void Run(double seconds, const Report& report) {
    const StopSignal stop;
    Supervision supervision;
    const MonoNs end = seconds > 0 ? clock_.Now() + static_cast<MonoNs>(std::llround(seconds * 1e9)) : kNever;
    MonoNs next = clock_.Now();
    supervision.Ready();
    while (!stop.Requested() && clock_.Now() < end) {
      std::array<pollfd, 2> files = {{{port_->FileDescriptor(), POLLIN, 0}, {stop.FileDescriptor(), POLLIN, 0}}};
      static_cast<void>(PollUntil(files, std::min(next, end), clock_));
      const std::int32_t epoch = keeper_.epoch();
      while (const auto received = port_->Receive()) OnPacket(*received);
      if (clock_.Now() < next && keeper_.epoch() == epoch) continue;
      Publish(report, supervision);
      if (clock_.Now() < next) continue;
      if (!IsRoot()) Request();
      next = std::max(next + kCycle, clock_.Now());
    }
    supervision.Stopping();
  }

 private:
  [[nodiscard]] bool IsRoot() const { return host_ == time_.root; }
  [[nodiscard]] std::int64_t BaseId() const {
    return NameHash("CLOCK_MONOTONIC_RAW " + std::to_string(origin_.clock_id));
  }

  void OnPacket(const TimePort::Received& received) {
    const TimePacket& packet = received.packet;
    if (packet.machine_id != origin_.machine_id) return;
    if (IsRoot()) {
      if (packet.kind != TimePacket::Kind::kRequest) return;
      // Of a request that the network refuses to answer, the other host knows by the missing answer.
      static_cast<void>(port_->Answer({.kind = TimePacket::Kind::kAnswer,
                                       .nonce = packet.nonce,
                                       .machine_id = origin_.machine_id,
                                       .base_id = BaseId(),
                                       .asked = received.raw}));
      return;
    }
    if (packet.kind != TimePacket::Kind::kAnswer || !asked_ || packet.nonce != nonce_) return;
    if (keeper_.OnExchange({*asked_, received.raw, packet.asked, packet.answered}, packet.base_id)) asked_.reset();
  }

  void Request() {
    if (asked_) ++unanswered_;
    nonce_ = RandomBootId();
    const Result<MonoNs> sent = port_->Request({.nonce = nonce_, .machine_id = origin_.machine_id});
    asked_ = sent ? std::optional(*sent) : std::nullopt;
    if (!sent) ++unanswered_;
  }

  // Returns what the daemon that keeps UNIX time claims. chronyd is asked once a second.
  UtcClaim Utc(const KernelUtc& kernel) {
    const MonoNs now = clock_.Now();
    if (auto tracking = chrony_.Receive()) {
      tracking_ = std::move(*tracking);
      tracked_ = now;
    }
    if (now >= next_question_) {
      chrony_.Ask();
      next_question_ = now + kSecond;
    }
    if (tracking_ && now - tracked_ > UtcClaim::kFresh) tracking_.reset();
    return tracking_ ? ClaimOfChrony(*tracking_, clock_.UtcMicroseconds() * kMicrosecond)
                     : ClaimOfPtp(time_.ptp_bound_us, kernel.synchronised);
  }

  template <typename Report>
  void Publish(const Report& report, Supervision& supervision) {
    keeper_.OnClocks(ReadHostClocks());
    time_quality_t message{};
    origin_.Set(message);
    keeper_.Describe(message);
    message.utime = clock_.UtcMicroseconds() - (clock_.Now() - message.mono_ns) / kMicrosecond;
    message.seq = seq_++;
    message.host = host_;
    message.root = time_.root;
    message.unanswered = unanswered_;
    const KernelUtc utc = ReadKernelUtc();
    message.tai_offset_s = utc.tai_offset_s;
    DescribeUtc(Utc(utc), ReadUtc(), message);
    message.flags = (utc.leap_today ? Q::FLAG_LEAP_TODAY : 0) | (virtual_machine_ ? Q::FLAG_VIRTUAL_MACHINE : 0);
    static_cast<void>(axlecast::Publish(messages_, "TIME/" + host_, message));
    static_cast<void>(axlecast::Publish(to_drivers_, "DRIVER_TIME/" + host_, message));
    supervision.Progress(clock_.Now());
    const std::string network = reception_.NextLine(messages_.received(), clock_.Now());
    if (!network.empty()) std::cerr << Printable(host_ + ": " + network) << '\n';
    if (reported_ && reported_->state == message.state && reported_->epoch == message.epoch &&
        reported_->reason == message.reason)
      return;
    reported_ = message;
    supervision.Status(ClaimText(message));
    report(message);
  }

  const TimeConfig& time_;
  const std::string host_;
  SystemClock clock_;
  Origin origin_;
  LcmPort messages_;
  LcmPort to_drivers_;  // the command port, which drivers receive; not the positions of the machine
  ReceptionReport reception_;
  std::optional<TimePort> port_;
  TimeKeeper keeper_;
  const bool virtual_machine_;
  std::int64_t seq_ = 0;
  std::int64_t nonce_ = 0;
  ChronyPort chrony_;
  std::optional<ChronyTracking> tracking_;
  MonoNs tracked_ = 0;
  MonoNs next_question_ = 0;
  std::optional<MonoNs> asked_;  // CLOCK_MONOTONIC_RAW of the request that has no answer yet
  std::int64_t unanswered_ = 0;
  std::optional<time_quality_t> reported_;
};

struct TimeOptions {
  ConfigOption config;
  std::string host;
  double seconds = 0;
  bool json = false;
};

int RunTime(const TimeOptions& options) {
  const Result<MachineConfig> machine = options.config.Load();
  if (!machine) return options.config.Fail(machine.error());
  if (machine->time.root.empty()) {
    return Fail("the machine's file has no time base: add `time: {root: HOST, address: IP ADDRESS OF HOST}`",
                kExitBad);
  }
  const std::string host = ThisHost(options.host);
  if (!IsHostName(host)) return Fail(Quoted(host) + " is no name of a host: give --host NAME", kExitUsage);
  TimeService service(*machine, host);
  if (const Result<> opened = service.Open(); !opened) return Fail(opened.error().text, kExitFailed);
  service.Run(options.seconds, [&](const time_quality_t& quality) {
    if (options.json) {
      static_cast<void>(WriteOut(JsonLine(ToJson(quality)) + '\n'));
    } else {
      std::cerr << Printable(host + ": " + ClaimText(quality)) << '\n';
    }
  });
  return kExitDone;
}

}  // namespace

void AddTimeCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<TimeOptions>();
  CLI::App* command =
      app.add_subcommand("time", "Keep the time base of a machine on several hosts, one process per host");
  options->config.AddTo(*command, ConfigOption::Form::kPositional);
  AddHostOption(*command, options->host);
  command->add_option("--seconds", options->seconds, "End after this time")
      ->check(CLI::Range(0.001, 1e9))
      ->type_name("S");
  command->add_flag("--json", options->json,
                    "Print a JSON object for each change of state instead of a line of text");
  command->footer(
      "examples:\n"
      "  axlecast time machine.yaml               on each host of the machine; the root answers, the others ask "
      "it\n"
      "  axlecast time machine.yaml --host cell2  under another name than the host's\n"
      "It publishes TIME/<host>, ten times a second: docs/time.md.\n"
      "exit code: 0 done, 1 the machine's file is bad or has no time base, 2 usage, 4 failed");
  command->callback([options, &exit_code] { exit_code = RunTime(*options); });
}

}  // namespace axlecast
