#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "core/base/result.h"
#include "core/base/spelling.h"
#include "core/base/time.h"
#include "core/messages/json/field.h"
#include "platform/os/new_file.h"
#include "platform/os/system_clock.h"
#include "platform/os/terminal.h"
#include "tools/axlecast/common/subcommands.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/scan/scan.h"
#include "tools/scan/scan_lines.h"

namespace axlecast {
namespace {

constexpr MonoNs kRedraw = 200 * kMillisecond;
constexpr const char* kClearLine = "\r\x1b[K";

// Shows the current trial of a scan on standard error: on a terminal in one line that changes, else one line per trial.
class ScanProgress {
 public:
  ScanProgress(ScanLineKind kind, const Clock& clock) : kind_(kind), clock_(clock) {}
  ~ScanProgress() { Clear(); }
  ScanProgress(const ScanProgress&) = delete;
  ScanProgress& operator=(const ScanProgress&) = delete;

  void Show(const PlannedTrial& planned, double done, MonoNs left) {
    const std::string line = LineText(planned.trial, kind_);
    const std::string what = std::string(planned.trial.asks ? "asking" : "listening") +
                             (line.empty() ? "" : " at " + line) + ": " + planned.trial.what;
    const bool is_new = what != std::exchange(last_, what);
    const MonoNs seconds_left = (left + kSecond - 1) / kSecond;
    if (!terminal_) {
      if (is_new) std::cerr << what << " (at most " << seconds_left << " s left)\n";
      return;
    }
    const MonoNs now = clock_.Now();
    if (!is_new && now - drawn_at_ < kRedraw) return;
    drawn_at_ = now;
    drawn_ = true;
    SteerTerminal(kClearLine);
    std::cerr << what << "  " << std::lround(100 * done) << " %, at most " << seconds_left << " s left"
              << std::flush;
  }

  // Removes the line. Call it before anything else is printed.
  void Clear() {
    if (drawn_) SteerTerminal(kClearLine);
    drawn_ = false;
  }

 private:
  const ScanLineKind kind_;
  const Clock& clock_;
  const bool terminal_ = isatty(STDERR_FILENO) == 1;
  bool drawn_ = false;
  MonoNs drawn_at_ = 0;
  std::string last_;
};

struct ScanOptions {
  ScanPlace place;
  ProbeScope scope;
  std::string parity = "none";
  std::string addresses;
  std::string write;
  bool sole_master = false;
  bool force = false;
  bool json = false;
};

constexpr const char* kExamples =
    "It listens first. It sends requests only if the line is silent and you have confirmed, at the prompt or with\n"
    "--sole-master, that no other master uses it. It only reads, and never writes. docs/scan.md lists the trials.\n"
    "Exit code: 0 something was found, 6 nothing, 1 the port or the file is refused, 2 usage. Ctrl-C ends it and\n"
    "prints what was found until then.\n"
    "\n"
    "Examples:\n"
    "  axlecast scan /dev/serial/by-id/usb-FTDI_USB-RS485_FT7ABC-if00-port0\n"
    "  axlecast scan /dev/ttyUSB0 --sole-master --write machine.yaml && axlecast up machine.yaml\n"
    "  axlecast scan /dev/ttyUSB0 --baud 115200    # only at this rate; also finds polled encoders with it\n"
    "  sudo axlecast scan can0                     # every bit rate, listening only, if can0 is down\n"
    "  axlecast scan /dev/spidev0.0 --sole-master\n"
    "  axlecast scan /dev/ttyUSB0 --sole-master --json | jq -r '.found[].device'";

// ---- the command line ----

// Parses "5" or "1-32".
Result<> ParseAddresses(const std::string& text, ProbeScope& scope) {
  const std::size_t dash = text.find('-');
  const std::string first = text.substr(0, dash);
  const std::string last = dash == std::string::npos ? first : text.substr(dash + 1);
  const auto digits = [](const std::string& word) {
    return !word.empty() && word.size() <= 3 && word.find_first_not_of("0123456789") == std::string::npos;
  };
  if (!digits(first) || !digits(last) || std::stoi(first) > std::stoi(last) || std::stoi(last) > 255) {
    return Failure("--addresses: " + Quoted(text) + " is no range, e.g. 1-32 or 5");
  }
  scope.first_address = std::stoi(first);
  scope.last_address = std::stoi(last);
  return {};
}

// Returns the kind of a port by its name: can0, /dev/spidev0.0; sockets of simulated buses by their ending.
ScanLineKind KindOf(const std::string& port) {
  if (port.find('/') == std::string::npos || port.ends_with(".can")) return ScanLineKind::kCan;
  std::error_code ignored;
  const std::string path = std::filesystem::weakly_canonical(port, ignored).string();
  const bool spi = path.starts_with("/dev/spidev") || port.ends_with(".spi");
  return spi ? ScanLineKind::kSpi : ScanLineKind::kSerial;
}

Result<> CompleteOptions(ScanOptions& options) {
  if (!options.addresses.empty()) {
    if (Result<> parsed = ParseAddresses(options.addresses, options.scope); !parsed) return parsed;
  }
  if (!IsName(options.place.machine)) return Failure("--machine: " + Quoted(options.place.machine) + kNameRule);
  if (!IsName(options.place.bus)) return Failure("--bus: " + Quoted(options.place.bus) + kNameRule);
  if (options.force && options.write.empty()) return Failure("--force needs --write");
  options.scope.parity = options.parity == "even"  ? Parity::kEven
                         : options.parity == "odd" ? Parity::kOdd
                                                   : Parity::kNone;
  options.place.kind = KindOf(options.place.port);
  return {};
}

// ---- asking the operator ----

bool Agreed(const std::string& question) {
  if (isatty(STDIN_FILENO) != 1) {
    std::cerr << "standard input is no terminal: without --sole-master, nothing is sent or set\n";
    return false;
  }
  std::cerr << question;
  std::string answer;
  std::getline(std::cin, answer);
  return answer == "y" || answer == "Y" || answer == "yes";
}

bool MayAsk(const ScanOptions& options, ScanProgress& progress) {
  if (options.sole_master) return true;
  progress.Clear();
  return Agreed("No device transmits by itself on " + options.place.port +
                ". The next trials send requests: they read, and never write.\n"
                "They disturb any other master on this line (a PLC, a drive, another program), and interface "
                "circuits may be\n"
                "destroyed. Is this computer the only master on the line? [y/N] ");
}

// ---- the scan ----

int Report(const ScanOptions& options, const ScanReport& report) {
  const std::string yaml = ScanYaml(options.place, report);
  if (options.json) {
    std::cout << JsonLine(ScanJson(options.place, report)) << '\n';
  } else {
    std::cout << ScanText(options.place, report);
    if (!yaml.empty() && options.write.empty()) std::cout << '\n' << yaml;
  }
  if (report.found.empty()) return kExitNoAnswer;
  if (options.write.empty()) return kExitDone;
  if (yaml.empty()) return Fail("there is nothing to write into " + options.write, kExitBad);
  const Result<> written = WriteNewFile(options.write, yaml, {.mode = 0644}, options.force);
  if (!written) return Fail(written.error().text, kExitBad);
  return Fail("written: " + options.write + "; try it: axlecast up " + options.write, kExitDone);
}

ScanReport Run(ScanLine& line, const Clock& clock, std::vector<PlannedTrial> plan, const ScanOptions& options) {
  ScanProgress progress(options.place.kind, clock);
  const CancelOnSignal cancel;
  ScanHooks hooks;
  hooks.stop = [] { return CancelOnSignal::requested().load(); };
  hooks.may_ask = [&] { return MayAsk(options, progress); };
  hooks.progress = [&](const PlannedTrial& planned, double done, MonoNs left) {
    progress.Show(planned, done, left);
  };
  return RunScan(line, clock, std::move(plan), hooks);
}

template <typename Line>
int ScanBytes(const ScanOptions& options, Line& line, const Clock& clock) {
  if (const Result<> opened = line.Open(); !opened) return Fail(opened.error().text, kExitBad);
  return Report(options, Run(line, clock, PlanScan(FamilyProbes(), options.place.kind, options.scope), options));
}

// Returns the bit rates to listen at. Without permission to set them, prints the reason and what to type.
std::vector<std::int64_t> BitratesOf(const ScanOptions& options, CanScanLine& line) {
  if (line.is_up()) return {line.bitrate()};
  const std::string& port = options.place.port;
  if (!line.MayConfigure()) {
    std::cerr << port << " is down. As root `axlecast scan " << port
              << "` sets it to each bit rate in turn, listening only; or type, as root,\n  " << line.ListenLine()
              << "\nand scan again\n";
    return {};
  }
  const std::string question = port +
                               " is down. The scan sets it to one bit rate after the other, listening only: it\n"
                               "sends and acknowledges nothing. At the end, the scan sets it down again.";
  if (!options.sole_master && !Agreed(question + " Continue? [y/N] ")) return {};
  return options.scope.rates.empty() ? CanBitrates() : options.scope.rates;
}

int ScanCan(const ScanOptions& options, const Clock& clock) {
  CanScanLine line(options.place.port, clock);
  if (const Result<> opened = line.Open(); !opened) return Fail(opened.error().text, kExitBad);
  const std::vector<std::int64_t> bitrates = BitratesOf(options, line);
  if (bitrates.empty()) return kExitBad;
  const std::vector<PlannedTrial> plan = PlanScan(FamilyProbes(), options.place.kind, options.scope);
  return Report(options, Run(line, clock, AtBitrates(plan, bitrates), options));
}

int ScanPort(const ScanOptions& options) {
  const SystemClock clock;
  switch (options.place.kind) {
    case ScanLineKind::kCan:
      return ScanCan(options, clock);
    case ScanLineKind::kSpi: {
      SpiScanLine line(options.place.port, clock);
      return ScanBytes(options, line, clock);
    }
    case ScanLineKind::kSerial:
      break;
  }
  SerialScanLine line(options.place.port, options.place.echo, clock);
  return ScanBytes(options, line, clock);
}

int RunScanCommand(ScanOptions& options) {
  if (const Result<> complete = CompleteOptions(options); !complete) {
    return Fail("axlecast scan: " + complete.error().text, kExitUsage);
  }
  if (!options.write.empty() && !options.force && std::filesystem::exists(options.write)) {
    return Fail(options.write + " exists: choose another name, or replace it with --force", kExitBad);
  }
  return ScanPort(options);
}

}  // namespace

void AddScanCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ScanOptions>();
  CLI::App* command = app.add_subcommand("scan", "Find the devices on a port, and write a machine's file for them");
  command->add_option("PORT", options->place.port, "A serial port, a CAN interface (can0), or a spidev")
      ->required();
  command->add_flag("--sole-master", options->sole_master,
                    "No other master is on the line: the scan may send requests");
  command
      ->add_option("--baud,--bitrate,--clock", options->scope.rates,
                   "Only this rate: Bd, bit/s or Hz; repeat it for more: --baud 9600 --baud 19200")
      ->check(CLI::Range(1'200, 50'000'000));
  command
      ->add_option("--parity", options->parity,
                   "Parity of requests at --baud, for devices that have it as an order option")
      ->check(CLI::IsMember({"none", "even", "odd"}))
      ->capture_default_str();
  command->add_option("--addresses", options->addresses, "Only scan these addresses, e.g. 1-32");
  command->add_flag("--echo", options->place.echo, "The adapter receives its own transmission");
  command->add_option("--write", options->write, "Write the machine's file; an existing file is never overwritten");
  command->add_flag("--force", options->force, "With --write: replace an existing file");
  command->add_option("--machine", options->place.machine, "Name of the machine in the file")
      ->capture_default_str();
  command->add_option("--bus", options->place.bus, "Name of the bus in the file")->capture_default_str();
  command->add_flag("--json", options->json, "Print one object: port, complete, asked, found, notes, yaml");
  command->footer(kExamples);
  command->callback([options, &exit_code] { exit_code = RunScanCommand(*options); });
}

}  // namespace axlecast
