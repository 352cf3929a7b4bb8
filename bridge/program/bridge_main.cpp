#include "bridge/program/bridge_main.h"

#include <poll.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <array>
#include <atomic>
#include <cstdlib>
#include <iostream>
#include <string>

#include "bridge/dispatch/dispatcher.h"
#include "bridge/store/journal_queue.h"
#include "bridge/store/sqlite_store.h"
#include "core/base/result.h"
#include "core/base/time.h"
#include "core/command/keys.h"
#include "core/config/load.h"
#include "platform/net/lcm_port.h"
#include "platform/os/process.h"
#include "platform/os/secret_file.h"
#include "platform/os/system_clock.h"
#include "platform/os/terminal.h"
#include "platform/os/terminal_log.h"

namespace axlecast {
namespace {

constexpr int kStopped = 0;
constexpr int kFailed = 1;
constexpr int kUsage = 2;
constexpr MonoNs kTick = 10 * kMillisecond;
constexpr int kJournalSeconds = 5;  // for the last writes

// A time that passes is no other problem.
std::string WithoutFigures(std::string text) {
  std::erase_if(text, [](char character) { return character >= '0' && character <= '9'; });
  return text;
}

// The bridge with its ports and clocks.
class BridgeProgram {
 public:
  BridgeProgram(const MachineConfig& machine, const BridgeInterposers& interposers)
      : port_(machine.lcm.command_url, machine.lcm.prefix, machine.machine),
        data_(machine.lcm.url, machine.lcm.prefix, machine.machine),
        origin_(NewOrigin(machine.machine)),
        key_(LoadBridgeKey(machine.bridge)),
        journal_([this, file = JournalFile(machine), name = machine.machine, interpose = interposers.store] {
          auto made = std::make_unique<SqliteStore>(file, name);
          if (made->in_use()) taken_by_ = made->state().error().text;
          taken_ = made->in_use();
          std::unique_ptr<DurableStore> store = std::move(made);
          return interpose ? interpose(std::move(store)) : std::move(store);
        }),
        interposed_port_(interposers.commands ? interposers.commands(port_) : nullptr),
        dispatcher_(machine, origin_,
                    {.journal = &journal_,
                     .commands = interposed_port_ ? interposed_port_.get() : &port_,
                     .data = &data_,
                     .key = key_ ? &*key_ : nullptr,
                     .other_machines = [this] { return port_.received().machines; },
                     .log = [](const std::string& line) { spdlog::info("{}", line); },
                     .random = RandomId},
                    Now()) {}

  int Run() {
    if (!data_.problem().empty() || !port_.problem().empty() || !Subscribe()) {
      spdlog::error("{}", data_.problem().empty() ? port_.problem() : data_.problem());
      return kFailed;
    }
    while (!stop_.Requested()) {
      if (!Receive()) {
        spdlog::error("the command port failed: the bridge stops, to be started again by its supervisor");
        return kFailed;
      }
      if (taken_) {
        spdlog::error("{}", taken_by_);
        return kFailed;
      }
      const Timestamp now = Now();
      dispatcher_.Settle(now);
      if (now.mono >= next_tick_) {
        next_tick_ = now.mono + kTick;
        dispatcher_.Tick(now);
      }
      if (!Serve(now)) return kFailed;
      ReportJournal(now.mono);
      ReportReception(now.mono);
      supervision_.Progress(now.mono);
    }
    supervision_.Stopping();
    EndJournal();
    spdlog::info("stopped");
    return kStopped;
  }

 private:
  // A bridge without its key runs, but its messages are not accepted. ALARM/bridge reports the cause.
  static std::optional<SigningKey> LoadBridgeKey(const BridgeConfig& config) {
    if (config.bridge.place.empty()) return std::nullopt;
    if (const Result<> done = ForbidCoreDumps(); !done) spdlog::warn("{}", done.error().text);
    SecretFiles secrets;
    Result<std::optional<SigningKey>> key = LoadKey(config.bridge, secrets);
    if (key) return std::move(*key);
    spdlog::error("{}", key.error().text);
    return std::nullopt;
  }

  Timestamp Now() {
    const MonoNs mono = clock_.Now();
    time_.Update(mono, clock_.UtcMicroseconds());
    return {mono, time_.Utime(mono)};
  }

  // Waits for a message, an answer of the journal or the next tick. False when the port failed.
  bool Receive() {
    std::array<pollfd, 2> files{{{port_.FileDescriptor(), POLLIN, 0}, {journal_.FileDescriptor(), POLLIN, 0}}};
    if (PollUntil(files, clock_.Now() + kTick, clock_) < 0) return false;
    return files[0].revents == 0 || port_.Handle(0);
  }

  bool Subscribe() {
    return port_.Subscribe("COMMAND", [this](const auto&, Bytes bytes) {
      dispatcher_.OnCommand(bytes, Now());
    }) && port_.Subscribe("DRIVER_STATUS/.*", [this](const auto& channel, Bytes bytes) {
      dispatcher_.OnDriverStatus(channel, bytes, Now());
    }) && port_.Subscribe("COMMAND_STATUS", [this](const auto&, Bytes bytes) {
      dispatcher_.OnCommandStatus(bytes, Now());
    });
  }

  // False when another bridge was here first.
  bool Serve(Timestamp now) {
    const bool other = dispatcher_.watch().Other(now.mono).has_value();
    if (!serving_ && other) {
      spdlog::error(
          "another bridge serves this command port already: stop it, or give this machine its own command_url or "
          "prefix");
      return false;
    }
    if (!serving_ && !dispatcher_.watch().IsListening(now.mono)) {
      serving_ = true;
      supervision_.Ready();
      spdlog::info("serving commands, boot id {:016x}", origin_.boot_id);
    }
    if (other != contested_) {
      contested_ = other;
      if (other) {
        spdlog::error("another bridge appeared on this command port: new commands are refused until one stops");
      } else {
        spdlog::info("the other bridge has gone: commands are served again");
      }
    }
    return true;
  }

  void ReportReception(MonoNs now) {
    ReceptionCounts counts = port_.received();
    counts += data_.received();
    const std::string lost = reception_.NextLine(counts, now, port_.warning());
    if (!lost.empty()) spdlog::warn("{}", lost);
  }

  // A thread that a disk holds cannot be ended: the process ends without it.
  void EndJournal() {
    journal_.Finish();
    const MonoNs end = clock_.Now() + kJournalSeconds * kSecond;
    while (!journal_.ended() && clock_.Now() < end) poll(nullptr, 0, 5);
    if (journal_.ended()) return;
    spdlog::error("the journal's disk has not answered for {} s: what it has not written is lost", kJournalSeconds);
    spdlog::shutdown();
    std::_Exit(kFailed);
  }

  void ReportJournal(MonoNs now) {
    if (!serving_) return;  // it is being read
    const std::string problem = ErrorText(dispatcher_.CheckJournal(now));
    if (WithoutFigures(problem) == WithoutFigures(reported_problem_)) return;
    reported_problem_ = problem;
    if (problem.empty()) {
      spdlog::info("the journal works again");
    } else {
      spdlog::error("commands that change a device are refused: {}", problem);
    }
  }

  SystemClock clock_;
  Timebase time_;
  StopSignal stop_;
  Supervision supervision_;
  LcmPort port_;
  LcmPort data_;
  const Origin origin_;
  const std::optional<SigningKey> key_;
  std::string taken_by_;             // written before taken_ is true
  std::atomic<bool> taken_ = false;  // another bridge has the journal
  JournalThread journal_;
  const std::unique_ptr<MessageSink> interposed_port_;
  Dispatcher dispatcher_;
  ReceptionReport reception_;
  MonoNs next_tick_ = 0;
  bool serving_ = false;
  bool contested_ = false;
  std::string reported_problem_;
};

}  // namespace

int BridgeMain(int argc, char** argv, const BridgeInterposers& interposers) {
  std::string config;
  CLI::App app{"Routes commands to the drivers and gives each exactly one outcome."};
  app.footer(
      "Runs until SIGTERM or SIGINT. Exit codes: 0 clean stop, 1 configuration, LCM, or another bridge on the port "
      "or with the journal, 2 usage.");
  app.set_version_flag("--version", AXLECAST_VERSION);
  app.add_option("--config", config, "The machine's file")->required();
  const TerminalOutput safe;
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kStopped : kUsage;
  }
  ConfigErrors errors(config);
  const auto machine = LoadConfig(config, errors);
  if (!machine) {
    std::cerr << errors.Text();
    return kFailed;
  }
  spdlog::set_default_logger(std::make_shared<spdlog::logger>("bridge", std::make_shared<TerminalLogSink>()));
  spdlog::set_pattern("%Y-%m-%dT%H:%M:%S.%eZ %^%l%$ %n: %v", spdlog::pattern_time_type::utc);
  if (machine->bridge.allow_unsigned) {
    spdlog::warn("unsigned commands are allowed: anybody on this network segment can command the devices");
  }
  return BridgeProgram(*machine, interposers).Run();
}

}  // namespace axlecast
