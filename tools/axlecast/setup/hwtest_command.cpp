#include "tools/axlecast/common/subcommands.h"

#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <memory>

#include "core/base/result.h"
#include "core/base/utc_text.h"
#include "platform/net/lcm_port.h"
#include "platform/os/new_file.h"
#include "platform/os/process.h"
#include "platform/os/system_clock.h"
#include "platform/os/terminal.h"
#include "tools/axlecast/common/config_option.h"
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
        port_(machine.lcm.url, machine.lcm.prefix, machine.machine) {}

  int Run() {
    if (const Result<> listening = Listen(); !listening) return Fail(listening.error().text, kExitFailed);
    const auto complete = [this] { return watch_.Complete(); };
    if (!Gather(kFirstMessages, complete, "") || !watch_.Complete()) {
      return Fail(options_.device + ": no message received; is its driver running? (axlecast driver " + bus_.name +
                      ")" + NetworkNote(port_.received()),
                  stop_.Requested() ? kExitRejected : kExitNoAnswer);
    }
    const MonoNs time = static_cast<MonoNs>(std::llround(options_.seconds * 1e9));
    const auto never = [] { return false; };
    if (!Gather(time, never, "watching")) return kExitRejected;
    Findings findings = {LineFindings(bus_)};
    for (FindingGroup& group : watch_.Evaluate()) findings.push_back(std::move(group));
    if (!options_.no_reads) {
      OperatorClient client(machine_, options_.key, false);
      findings.push_back(ReadFindings(bus_, ReadEverything(client, bus_, options_.device)));
    }
    findings.push_back(Rotation());
    return Report(findings);
  }

 private:
  Result<> Listen() {
    if (!port_.problem().empty()) return Failure(port_.problem());
    const auto handler = [this](const std::string& channel, Bytes message) { watch_.OnMessage(channel, message); };
    const std::string channels = "(POSITION|DEVICE|ALARM)/" + options_.device + "|BUS/" + bus_.name;
    if (port_.Subscribe(channels, handler)) return {};
    return Failure("cannot subscribe on " + machine_.lcm.url);
  }

  // Returns false if a signal stopped it, or the port failed.
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
    constexpr const char* kTurn = "one turn by hand";
    if (!bus_.family->has_position)
      return {"Direction", {{kTurn, "a monitor has no shaft", Verdict::kUnjudged, ""}}};
    if (!watch_.position())
      return {"Direction", {{kTurn, "not done", Verdict::kUnjudged, "there is no valid position"}}};
    if (options_.no_rotation || isatty(STDIN_FILENO) != 1) {
      return {"Direction", {{kTurn, "not done", Verdict::kUnjudged, "run it at a terminal, with the shaft free"}}};
    }
    const std::int8_t direction = watch_.info()->direction;
    while (EnterWasPressed()) continue;  // ignores earlier input
    std::cerr << "Turn the shaft by hand one turn " << (direction >= 0 ? "counter-clockwise" : "clockwise")
              << ", seen from the shaft end, then press Enter.\n";
    const std::int64_t before = watch_.position()->counts;
    if (!Gather(kLongestTurn, &EnterWasPressed, ""))
      return {"Direction", {{kTurn, "given up", Verdict::kUnjudged, ""}}};
    const auto per_turn = static_cast<double>(watch_.position()->counts_per_turn);
    const double turns = static_cast<double>(watch_.position()->counts - before) / per_turn;
    return {"Direction", {EvaluateRotation(turns, direction)}};
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
    const nlohmann::ordered_json json = {{"machine", machine_.machine},
                                         {"device", options_.device},
                                         {"bus", bus_.name},
                                         {"simulated", bus_.simulate},
                                         {"utime", now},
                                         {"seconds", options_.seconds},
                                         {"verdict", VerdictName(worst)},
                                         {"findings", FindingsJson(findings)}};
    Show(json, FindingsText(findings) + options_.device + ": " + std::string(VerdictName(worst)) + '\n',
         options_.json);
    if (!options_.html.empty()) {
      const Result<> written = WriteOutput(options_.html, Page(findings, worst, now));
      if (!written) return Fail(written.error().text, kExitFailed);
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
    if (bus_.simulate)
      page.Paragraph("The device and its line are simulated: the results do not apply to hardware.");
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

int RunHwtest(const MachineConfig& machine, const Options& options) {
  if (machine.BusOf(options.device) == nullptr) return Fail(UnknownDevice(machine, options.device), kExitUsage);
  return Acceptance(options, machine).Run();
}

}  // namespace

void AddHwtestCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("hwtest", "Write an acceptance report of one device");
  command->add_option("DEVICE", options->device, "The device")->required();
  options->config.AddTo(*command, ConfigOption::Form::kOptionOnly);
  command->add_option("--seconds", options->seconds, "Watch the readings for this time")
      ->check(CLI::Range(1.0, 86'400.0))
      ->capture_default_str()
      ->type_name("S");
  command->add_option("--html", options->html, "Also write the report as a page to print")->type_name("FILE");
  command->add_option("--key", options->key, "Secret key that signs the reads")->type_name("FILE");
  command->add_flag("--no-reads", options->no_reads, "Do not read the device through the bridge");
  command->add_flag("--no-rotation", options->no_rotation, "Do not ask for a turn by hand");
  command->add_flag("--json", options->json, "Print one JSON object");
  command->footer(
      "examples:\n"
      "  axlecast hwtest axis1                        at a terminal: asks for one turn of the shaft by hand\n"
      "  axlecast hwtest axis1 --seconds 600 --html axis1.html\n"
      "Its driver must run; nothing is written to the device.\n"
      "exit code: 0 nothing bad, 1 something is bad, 2 usage, 3 it was stopped, 4 failed, 6 no message from "
      "the device");
  RunOnMachine<Options>(*command, options, exit_code, &RunHwtest);
}

}  // namespace axlecast
