#include <CLI/CLI.hpp>
#include <algorithm>
#include <axlecast/position_set_t.hpp>
#include <cmath>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "core/base/text.h"
#include "core/messages/message.h"
#include "core/messages/origin.h"
#include "platform/net/lcm_port.h"
#include "platform/os/process.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/subcommands.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/live/set_reception.h"

namespace axlecast {
namespace {

constexpr MonoNs kSlice = 50 * kMillisecond;

struct SetsOptions {
  ConfigOption config;
  double seconds = 0;
  bool json = false;
};

// Publishes POSITION_SET/<set> for every set of the machine.
class SetsService {
 public:
  explicit SetsService(const MachineConfig& machine)
      : origin_(NewOrigin(machine.machine)), reception_(machine, machine.sets, clock_) {}

  [[nodiscard]] Result<> Open() {
    return reception_.Open([this](const SetConfig& set, const position_set_t& message) { Publish(set, message); });
  }

  // Runs until a signal, or for `seconds` (0: no limit). Fails if LCM fails.
  [[nodiscard]] Result<> Run(double seconds) {
    const StopSignal stop;
    Supervision supervision;
    ReceptionReport losses;
    const MonoNs end = seconds > 0 ? clock_.Now() + static_cast<MonoNs>(std::llround(seconds * 1e9)) : kNever;
    MonoNs next_status = 0;
    supervision.Ready();
    for (MonoNs now = clock_.Now(); !stop.Requested() && now < end; now = clock_.Now()) {
      if (!reception_.Gather(std::min(end, now + kSlice))) return Failure("the LCM port failed");
      supervision.Progress(now);
      if (now >= next_status) {
        supervision.Status(StatusLine());
        next_status = now + kSecond;
      }
      const std::string lost = losses.NextLine(reception_.port().received(), now, reception_.port().warning());
      if (!lost.empty()) std::cerr << lost << '\n';
    }
    supervision.Stopping();
    return {};
  }

  [[nodiscard]] std::string StatusLine() const {
    const std::int64_t sets = reception_.totals().sets;
    return Text("%lld sets, %lld aligned, %lld not aligned, %lld incomplete", static_cast<long long>(sets),
                static_cast<long long>(sets - wider_ - incomplete_), static_cast<long long>(wider_),
                static_cast<long long>(incomplete_));
  }
  [[nodiscard]] nlohmann::ordered_json StatusJson() const {
    const PositionSetBuilder::Totals totals = reception_.totals();
    return {{"sets", totals.sets},
            {"not_aligned", wider_},
            {"incomplete", incomplete_},
            {"late", totals.late},
            {"without_tick", totals.no_tick}};
  }

 private:
  void Publish(const SetConfig& set, position_set_t message) {
    origin_.Set(message);
    message.mono_ns = clock_.Now();
    message.utime = clock_.UtcMicroseconds();
    std::int64_t& seq = seq_[set.name];
    message.seq = seq;
    if (axlecast::Publish(reception_.port(), "POSITION_SET/" + set.name, message)) ++seq;
    if (message.state == position_set_t::STATE_NOT_ALIGNED) ++wider_;
    if (message.state == position_set_t::STATE_INCOMPLETE) ++incomplete_;
  }

  SystemClock clock_;
  Origin origin_;
  SetReception reception_;
  std::map<std::string, std::int64_t> seq_;  // of the next message, by set
  std::int64_t wider_ = 0;
  std::int64_t incomplete_ = 0;
};

int RunSets(const MachineConfig& machine, const SetsOptions& options) {
  if (machine.sets.empty()) {
    return Fail("the machine's file has no sets: add `sets: {NAME: {axes: [A, B], limit_us: 300}}`", kExitBad);
  }
  SetsService service(machine);
  if (const Result<> opened = service.Open(); !opened) return Fail(opened.error().text, kExitFailed);
  const Result<> done = service.Run(options.seconds);
  Show(service.StatusJson(), service.StatusLine() + '\n', options.json);
  return done ? kExitDone : Fail(done.error().text, kExitFailed);
}

}  // namespace

void AddSetsCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<SetsOptions>();
  CLI::App* command = app.add_subcommand("sets", "Publish the sets of the machine: several axes on one tick");
  options->config.AddTo(*command, ConfigOption::Form::kPositional);
  command->add_option("--seconds", options->seconds, "End after S seconds; without it, until a signal")
      ->check(CLI::Range(0.1, 1e9))
      ->type_name("S");
  command->add_flag("--json", options->json, "Print the counts at the end as one JSON object");
  command->footer(
      "examples:\n"
      "  axlecast sets machine.yaml                  until SIGTERM; axlecast up starts it by itself\n"
      "  axlecast watch --channel POSITION_SET       what it publishes");
  RunOnMachine<SetsOptions>(*command, options, exit_code, &RunSets);
}

}  // namespace axlecast
