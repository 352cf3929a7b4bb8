#include "core/base/result.h"
#include "tools/axlecast/setup/subcommands.h"

#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <memory>
#include <optional>

#include "core/base/utc_text.h"
#include "core/messages/json/field.h"
#include "platform/net/lcm_port.h"
#include "platform/os/new_file.h"
#include "platform/os/process.h"
#include "platform/os/system_clock.h"
#include "platform/os/terminal.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/device_data/device_access.h"
#include "tools/axlecast/live/format_device.h"
#include "tools/axlecast/setup/line_findings.h"
#include "tools/service/hardware_watch.h"

namespace axlecast {
namespace {

constexpr MonoNs kFirstMessages = 10 * kSecond;
constexpr MonoNs kSlice = 100 * kMillisecond;
constexpr MonoNs kLongestTurn = 120 * kSecond;

struct Options {
  ConfigOption config;
  std::string device;
  std::string html;
  std::string key;
  double seconds = 60;
  bool json = false;
  bool no_rotation = false;
  bool no_reads = false;
};

// One acceptance of a device, from its first message to the report.
class Acceptance {
 public:
  Acceptance(const Options& options, const MachineConfig& machine)
      : options_(options),
        machine_(machine),
        bus_(*machine.BusOf(options.device)),
        watch_(bus_, *std::find_if(bus_.devices.begin(), bus_.devices.end(),
                                   [&](const DeviceConfig& device) { return device.name == options.device; })),
        port_(machine.lcm.url, machine.lcm.prefix) {}

  int Run() {
    if (const std::string problem = Listen(); !problem.empty()) {
      std::cerr << problem << '\n';
      return kExitFailed;
    }
    if (!Gather(
            kFirstMessages, [this] { return watch_.Heard(); }, "") ||
        !watch_.Heard()) {
      std::cerr << options_.device << ": nothing is heard; is its driver running? (axlecast driver " << bus_.name
                << ")\n";
      return stop_.Requested() ? kExitRejected : kExitNoAnswer;
    }
    const bool whole = Gather(
        static_cast<MonoNs>(std::llround(options_.seconds * 1e9)), [] { return false; }, "watching");
    if (!whole) return kExitRejected;
    Findings findings = {LineFindings(bus_)};
    for (FindingGroup& group : watch_.Judge()) findings.push_back(std::move(group));
    if (!options_.no_reads) {
      OperatorClient client(machine_, options_.key, false);
      findings.push_back(ReadFindings(bus_, ReadEverything(client, bus_, options_.device)));
    }
    findings.push_back(Rotation());
    return Report(findings);
  }

 private:
  std::string Listen() {
    if (!port_.problem().empty()) return port_.problem();
    const auto handler = [this](const std::string& channel, Bytes message) { watch_.OnMessage(channel, message); };
    return port_.Subscribe("(POSITION|DEVICE|ALARM)/" + options_.device + "|BUS/" + bus_.name, handler)
               ? ""
               : "cannot subscribe on " + machine_.lcm.url;
  }

  // False when it was stopped, or the port failed.
  bool Gather(MonoNs time, const std::function<bool()>& enough, const std::string& doing) {
    const MonoNs begin = clock_.Now();
    const bool shows = !doing.empty() && isatty(STDERR_FILENO) == 1;
    while (clock_.Now() - begin < time && !enough()) {
      if (stop_.Requested() || !port_.Handle(static_cast<int>(kSlice / kMillisecond))) return false;
      if (shows) {
        SteerTerminal("\r");
        std::cerr << doing << ' ' << (clock_.Now() - begin) / kSecond << " of " << time / kSecond << " s, "
                  << watch_.readings() << " readings, " << watch_.errors() << " failed" << std::flush;
      }
    }
    if (shows) std::cerr << '\n';
    return true;
  }

  FindingGroup Rotation() {
    FindingGroup group{"Direction", {}};
    if (!bus_.family->has_position)
      return {"Direction", {{"one turn by hand", "a monitor has no shaft of its own", Verdict::kUnjudged, ""}}};
    if (options_.no_rotation || isatty(STDIN_FILENO) != 1 || !watch_.position()) {
      group.findings.push_back(
          {"one turn by hand", "not done", Verdict::kUnjudged,
           watch_.position() ? "run it at a terminal, with the shaft free" : "there is no valid position"});
      return group;
    }
    const std::int8_t direction = watch_.info()->direction;
    while (EnterWasPressed()) continue;  // what was typed before says nothing
    std::cerr << "Turn the shaft by hand one turn " << (direction >= 0 ? "counter-clockwise" : "clockwise")
              << ", seen from the shaft end, then press Enter.\n";
    const std::int64_t before = watch_.position()->counts;
    const bool pressed = Gather(
        kLongestTurn, [] { return EnterWasPressed(); }, "");
    const auto per_turn = static_cast<double>(watch_.position()->counts_per_turn);
    const double turns = static_cast<double>(watch_.position()->counts - before) / per_turn;
    group.findings.push_back(pressed ? JudgeRotation(turns, direction)
                                     : AcceptanceResult{"one turn by hand", "given up", Verdict::kUnjudged, ""});
    return group;
  }

  static bool EnterWasPressed() {
    pollfd file{STDIN_FILENO, POLLIN, 0};
    if (poll(&file, 1, 0) <= 0) return false;
    std::array<char, 256> line{};
    return read(STDIN_FILENO, line.data(), line.size()) > 0;
  }

  int Report(const Findings& findings) {
    const Verdict worst = Worst(findings);
    const std::int64_t now = clock_.UtcMicroseconds();
    if (options_.json) {
      nlohmann::ordered_json json = {{"machine", machine_.machine},
                                     {"device", options_.device},
                                     {"bus", bus_.name},
                                     {"simulated", bus_.simulate},
                                     {"utime", now},
                                     {"seconds", options_.seconds},
                                     {"verdict", VerdictName(worst)}};
      json["findings"] = FindingsJson(findings);
      static_cast<void>(WriteOut(JsonLine(json) + '\n'));
    } else {
      static_cast<void>(
          WriteOut(FindingsText(findings) + options_.device + ": " + std::string(VerdictName(worst)) + '\n'));
    }
    if (!options_.html.empty()) {
      const std::string problem = ErrorText(WriteOutput(options_.html, Page(findings, worst, now)));
      if (!problem.empty()) {
        std::cerr << problem << '\n';
        return kExitFailed;
      }
    }
    return worst == Verdict::kBad ? kExitBad : kExitDone;
  }

  std::string Page(const Findings& findings, Verdict worst, std::int64_t now) {
    HtmlPage page("Acceptance of " + options_.device + ", machine " + machine_.machine);
    page.Facts({{{"device"}, {options_.device + " on " + bus_.name + " (" + std::string(bus_.family->name) + ")"}},
                {{"verdict"},
                 {std::string(VerdictName(worst)), worst == Verdict::kUnjudged ? "muted" : VerdictName(worst)}},
                {{"time (UTC)"}, {UtcText(now)}},
                {{"watched for"}, {std::to_string(std::lround(options_.seconds)) + " s"}},
                {{"axlecast"}, {AXLECAST_VERSION}}});
    if (bus_.simulate) page.Paragraph("The device and its line are simulated: this says nothing about hardware.");
    AddFindings(page, findings);
    page.Heading("Signed");
    page.Facts({{{"name, date"}, {""}}, {{"signature"}, {""}}});
    return page.Text();
  }

  const Options& options_;
  const MachineConfig& machine_;
  const BusConfig& bus_;
  SystemClock clock_;
  StopSignal stop_;
  HardwareWatch watch_;
  LcmPort port_;
};

int RunHwtest(const Options& options) {
  const auto machine = options.config.Load();
  if (!machine) return options.config.Fail(machine.error());
  if (machine->BusOf(options.device) == nullptr) {
    std::cerr << UnknownDevice(*machine, options.device) << '\n';
    return kExitUsage;
  }
  return Acceptance(options, *machine).Run();
}

}  // namespace

void AddHwtestCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("hwtest", "An acceptance report of one device");
  command->add_option("DEVICE", options->device, "The device")->required();
  options->config.AddTo(*command, ConfigOption::Form::kOptionOnly);
  command->add_option("--seconds", options->seconds, "How long readings are watched")
      ->check(CLI::Range(1.0, 86'400.0))
      ->capture_default_str()
      ->type_name("S");
  command->add_option("--html", options->html, "The report as a page to print")->type_name("FILE");
  command->add_option("--key", options->key, "Secret key that signs the reads")->type_name("FILE");
  command->add_flag("--no-reads", options->no_reads, "Reads nothing through the bridge");
  command->add_flag("--no-rotation", options->no_rotation, "Does not ask for a turn by hand");
  command->add_flag("--json", options->json, "One JSON object");
  command->footer(
      "examples:\n"
      "  axlecast hwtest axis1                        at a terminal: asks for one turn of the shaft by hand\n"
      "  axlecast hwtest axis1 --seconds 600 --html axis1.html\n"
      "Its driver must run; nothing is written to the device.\n"
      "exit code: 0 nothing bad, 1 something is bad, 2 usage, 3 it was stopped, 4 failed, 6 the device is not "
      "heard");
  command->callback([options, &exit_code] { exit_code = RunHwtest(*options); });
}

}  // namespace axlecast
