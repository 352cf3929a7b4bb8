#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/base/spelling.h"
#include "core/config/sets.h"
#include "platform/os/process.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/subcommands.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/live/set_reception.h"
#include "tools/axlecast/live/skew.h"

namespace axlecast {
namespace {

constexpr MonoNs kSlice = 50 * kMillisecond;
constexpr int kDefaultLimitUs = 300;

struct SkewOptions {
  ConfigOption config;
  std::vector<std::string> axes;  // or the name of one set
  int limit_us = 0;
  double seconds = 0;
  bool json = false;
};

Result<SetConfig> SetOf(const MachineConfig& machine, const SkewOptions& options) {
  SetConfig set;
  const auto named = std::ranges::find(machine.sets, options.axes.front(), &SetConfig::name);
  if (options.axes.size() == 1 && named != machine.sets.end()) {
    set = *named;
  } else {
    Result<SetConfig> made = MakeSet(machine, options.axes);
    if (!made) return Failure(made.error());
    set = std::move(*made);
    set.limit = kDefaultLimitUs * kMicrosecond;
  }
  if (options.limit_us > 0) set.limit = options.limit_us * kMicrosecond;
  return set;
}

int RunSkew(const MachineConfig& machine, const SkewOptions& options) {
  const Result<SetConfig> set = SetOf(machine, options);
  if (!set) return Fail(set.error().text, kExitUsage);
  const SystemClock clock;
  SetReception reception(machine, {*set}, clock);
  SkewStatistics skew(set->axes);
  if (const Result<> opened =
          reception.Open([&skew](const SetConfig&, const position_set_t& message) { skew.On(message); });
      !opened) {
    return Fail(opened.error().text, kExitBad);
  }
  const StopSignal stop;
  std::optional<Screen> screen;
  if (!options.json && Screen::Usable()) screen.emplace();
  const MonoNs end = options.seconds > 0 ? clock.Now() + std::llround(options.seconds * 1e9) : kNever;
  MonoNs next_draw = 0;
  for (MonoNs now = clock.Now(); !stop.Requested() && now < end; now = clock.Now()) {
    if (!reception.Gather(std::min(end, now + kSlice)))
      return Fail("the LCM port failed: " + machine.lcm.url, kExitBad);
    if (!screen || now < next_draw) continue;
    screen->Draw(skew.Lines());
    next_draw = now + kRedrawMs * kMillisecond;
  }
  screen.reset();
  std::string text;
  for (const std::string& line : skew.Lines()) text += line + '\n';
  Show(skew.ToJson(), text, options.json);
  if (skew.ticks() > 0) return kExitDone;
  return Fail(reception.totals().no_tick > 0 ? "the positions have no tick: the time base has no claim (axlecast "
                                               "status), or it is not running (axlecast time)"
                                             : "no position of these axes came: is the machine up, on this URL?",
              kExitNoAnswer);
}

}  // namespace

void AddSkewCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<SkewOptions>();
  CLI::App* command = app.add_subcommand("skew", "Show how far apart several axes are sampled on one tick");
  command->add_option("AXIS", options->axes, "Devices, or the name of one set of the machine's file")->required();
  options->config.AddTo(*command, ConfigOption::Form::kOptionOnly);
  command
      ->add_option("--limit-us", options->limit_us,
                   "Count a tick as aligned up to this hull; default: the set's, or 300")
      ->check(CLI::Range(1, 1'000'000))
      ->type_name("US");
  command->add_option("--seconds", options->seconds, "End after S seconds; without it, until Ctrl-C")
      ->check(CLI::Range(0.1, 1e9))
      ->type_name("S");
  command->add_flag("--json", options->json, "Print the result as one JSON object; no live table");
  command->footer(
      "examples:\n"
      "  axlecast skew x1 x2 y                       live until Ctrl-C\n"
      "  axlecast skew gantry --seconds 10           a set of the machine's file\n"
      "  axlecast skew x1 x2 --limit-us 200 --seconds 60 --json\n"
      "exit code 6 if no position with a tick arrived");
  RunOnMachine<SkewOptions>(*command, options, exit_code, &RunSkew);
}

}  // namespace axlecast
