#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/base/spelling.h"
#include "core/base/time.h"
#include "core/messages/json/field.h"
#include "platform/os/new_file.h"
#include "platform/os/system_clock.h"
#include "platform/os/terminal.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/setup/subcommands.h"
#include "tools/scan/format_scan.h"
#include "tools/scan/scan.h"
#include "tools/scan/scan_lines.h"

namespace axlecast {
namespace {

// Tells on standard error what a scan tries: on a terminal in one line that changes, else a line for each trial.
class ScanProgress {
 public:
  ScanProgress(ScanLineKind kind, const Clock& clock);
  ~ScanProgress() { Clear(); }
  ScanProgress(const ScanProgress&) = delete;
  ScanProgress& operator=(const ScanProgress&) = delete;

  void Show(const PlannedTrial& planned, double done, MonoNs left);
  // Before anything else is printed.
  void Clear();

 private:
  const ScanLineKind kind_;
  const Clock& clock_;
  const bool terminal_;
  bool drawn_ = false;
  MonoNs drawn_at_ = 0;
  std::string last_;
};

constexpr MonoNs kRedraw = 200 * kMillisecond;
constexpr const char* kClearLine = "\r\x1b[K";

std::string WhatOf(const PlannedTrial& planned, ScanLineKind kind) {
  const std::string line = LineText(planned.trial, kind);
  const char* how = planned.trial.asks ? "asking" : "listening";
  return std::string(how) + (line.empty() ? "" : " at " + line) + ": " + planned.trial.what;
}

ScanProgress::ScanProgress(ScanLineKind kind, const Clock& clock)
    : kind_(kind), clock_(clock), terminal_(isatty(STDERR_FILENO) == 1) {}

void ScanProgress::Show(const PlannedTrial& planned, double done, MonoNs left) {
  const std::string what = WhatOf(planned, kind_);
  const bool fresh = what != last_;
  last_ = what;
  if (!terminal_) {
    if (fresh) std::cerr << what << " (at most " << (left + kSecond - 1) / kSecond << " s left)\n";
    return;
  }
  const MonoNs now = clock_.Now();
  if (!fresh && now - drawn_at_ < kRedraw) return;
  drawn_at_ = now;
  drawn_ = true;
  SteerTerminal(kClearLine);
  std::cerr << what << "  " << std::lround(100 * done) << " %, at most " << (left + kSecond - 1) / kSecond
            << " s left" << std::flush;
}

void ScanProgress::Clear() {
  if (drawn_) SteerTerminal(kClearLine);
  drawn_ = false;
}

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
    "It listens first. Only a line on which nothing speaks is asked, and only after you have said that no other "
    "master\n"
    "is on it: at the prompt, or with --sole-master. It reads, and never writes. docs/scan.md says what is tried.\n"
    "Exit code: 0 something was found, 6 nothing, 1 the port or the file is refused, 2 usage. Ctrl-C ends it with "
    "what was\n"
    "found until then.\n"
    "\n"
    "Examples:\n"
    "  axlecast scan /dev/serial/by-id/usb-FTDI_USB-RS485_FT7ABC-if00-port0\n"
    "  axlecast scan /dev/ttyUSB0 --sole-master --write machine.yaml && axlecast up machine.yaml\n"
    "  axlecast scan /dev/ttyUSB0 --baud 115200    # at this rate alone; it is also asked for polled encoders "
    "then\n"
    "  sudo axlecast scan can0                     # every bit rate, listening only, where can0 is down\n"
    "  axlecast scan /dev/spidev0.0 --sole-master\n"
    "  axlecast scan /dev/ttyUSB0 --sole-master --json | jq -r '.found[].device'";

// ---- the command line ----

// "5" or "1-32"
std::string ParseAddresses(const std::string& text, ProbeScope& scope) {
  const std::size_t dash = text.find('-');
  const std::string first = text.substr(0, dash);
  const std::string last = dash == std::string::npos ? first : text.substr(dash + 1);
  const auto digits = [](const std::string& word) {
    return !word.empty() && word.size() <= 3 && word.find_first_not_of("0123456789") == std::string::npos;
  };
  if (!digits(first) || !digits(last) || std::stoi(first) > std::stoi(last) || std::stoi(last) > 255) {
    return "--addresses: " + Quoted(text) + " is no range, e.g. 1-32 or 5";
  }
  scope.first_address = std::stoi(first);
  scope.last_address = std::stoi(last);
  return "";
}

std::string Usage(ScanOptions& options) {
  if (!options.addresses.empty()) {
    if (std::string problem = ParseAddresses(options.addresses, options.scope); !problem.empty()) return problem;
  }
  if (!IsName(options.place.machine)) return "--machine: " + Quoted(options.place.machine) + kNameRule;
  if (!IsName(options.place.bus)) return "--bus: " + Quoted(options.place.bus) + kNameRule;
  if (options.force && options.write.empty()) return "--force goes with --write";
  options.scope.parity = options.parity == "even"  ? Parity::kEven
                         : options.parity == "odd" ? Parity::kOdd
                                                   : Parity::kNone;
  return "";
}

// By its name: can0, /dev/spidev0.0; the sockets of simulated buses by their ending.
ScanLineKind KindOf(const std::string& port) {
  if (port.find('/') == std::string::npos || port.ends_with(".can")) return ScanLineKind::kCan;
  std::error_code ignored;
  const std::string path = std::filesystem::weakly_canonical(port, ignored).string();
  const bool spi = path.starts_with("/dev/spidev") || port.ends_with(".spi");
  return spi ? ScanLineKind::kSpi : ScanLineKind::kSerial;
}

// ---- asking the operator ----

bool Agreed(const std::string& question) {
  if (isatty(STDIN_FILENO) != 1) {
    std::cerr << "standard input is no terminal: without --sole-master nothing is sent or set\n";
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
  return Agreed(
      "Nothing speaks on " + options.place.port +
      ". To look further it must be asked: reads, never a write.\n"
      "If another master (a PLC, a drive, another program) is on this line, it is disturbed, and interface\n"
      "circuits may be destroyed. Is this computer the only master on the line? [y/N] ");
}

// ---- the scan ----

std::string Write(const ScanOptions& options, const ScanReport& report) {
  const std::string yaml = ScanYaml(options.place, report);
  if (yaml.empty()) return "there is nothing to write into " + options.write;
  std::string problem = ErrorText(WriteNewFile(options.write, yaml, {.mode = 0644}, options.force));
  if (problem.empty())
    std::cerr << "written: " << options.write << "; try it: axlecast up " << options.write << '\n';
  return problem;
}

int Tell(const ScanOptions& options, const ScanReport& report) {
  if (options.json) {
    std::cout << JsonLine(ScanJson(options.place, report)) << '\n';
  } else {
    std::cout << ScanText(options.place, report);
    const std::string yaml = ScanYaml(options.place, report);
    if (!yaml.empty() && options.write.empty()) std::cout << '\n' << yaml;
  }
  if (report.found.empty()) return kExitNoAnswer;
  if (options.write.empty()) return kExitDone;
  const std::string problem = Write(options, report);
  if (problem.empty()) return kExitDone;
  std::cerr << problem << '\n';
  return kExitBad;
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
  if (const auto opened = line.Open(); !opened) return Fail(opened.error().text, kExitBad);
  return Tell(options, Run(line, clock, PlanScan(FamilyProbes(), options.place.kind, options.scope), options));
}

// The bit rates to listen at; none: says why, and what to type.
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
                               " is down. To listen it is set to one bit rate after the other, listening only: it\n"
                               "sends and acknowledges nothing. At the end it is set down again.";
  if (!options.sole_master && !Agreed(question + " Go on? [y/N] ")) return {};
  return options.scope.rates.empty() ? CanBitrates() : options.scope.rates;
}

int ScanCan(const ScanOptions& options, const Clock& clock) {
  CanScanLine line(options.place.port, clock);
  if (const auto opened = line.Open(); !opened) return Fail(opened.error().text, kExitBad);
  const std::vector<std::int64_t> bitrates = BitratesOf(options, line);
  if (bitrates.empty()) return kExitBad;
  const std::vector<PlannedTrial> plan = PlanScan(FamilyProbes(), options.place.kind, options.scope);
  return Tell(options, Run(line, clock, AtBitrates(plan, bitrates), options));
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
  if (const std::string problem = Usage(options); !problem.empty()) {
    std::cerr << "axlecast scan: " << problem << '\n';
    return kExitUsage;
  }
  if (!options.write.empty() && !options.force && std::filesystem::exists(options.write)) {
    std::cerr << options.write << " exists: choose another name, or replace it with --force\n";
    return kExitBad;
  }
  options.place.kind = KindOf(options.place.port);
  return ScanPort(options);
}

}  // namespace

void AddScanCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ScanOptions>();
  CLI::App* command =
      app.add_subcommand("scan", "Finds what is attached to a port, and writes the machine's file for it");
  command->add_option("PORT", options->place.port, "A serial port, a CAN interface (can0), or a spidev")
      ->required();
  command->add_flag("--sole-master", options->sole_master, "No other master is on the line: it may be asked");
  command
      ->add_option("--baud,--bitrate,--clock", options->scope.rates,
                   "Only this rate: Bd, bit/s or Hz; several: --baud 9600 --baud 19200")
      ->check(CLI::Range(1'200, 50'000'000));
  command->add_option("--parity", options->parity, "Of what is asked at --baud, where it is made to order")
      ->check(CLI::IsMember({"none", "even", "odd"}))
      ->capture_default_str();
  command->add_option("--addresses", options->addresses, "Only these, e.g. 1-32");
  command->add_flag("--echo", options->place.echo, "The adapter hears its own transmission");
  command->add_option("--write", options->write, "Writes the machine's file; never over one that exists");
  command->add_flag("--force", options->force, "With --write: replaces the file");
  command->add_option("--machine", options->place.machine, "Name of the machine in the file")
      ->capture_default_str();
  command->add_option("--bus", options->place.bus, "Name of the bus in the file")->capture_default_str();
  command->add_flag("--json", options->json, "One object: port, complete, asked, found, notes, yaml");
  command->footer(kExamples);
  command->callback([options, &exit_code] { exit_code = RunScanCommand(*options); });
}

}  // namespace axlecast
