#include "tools/scan/serial_scan_line.h"

#include "drivers/hal/line_guard.h"

namespace axlecast {
namespace {

// Every port makes it; each trial sets its own.
constexpr LineFormat kAtFirst = {.baud = 9'600};
constexpr int kMaxReads = 100;  // a line that never rests must not hold a scan up

}  // namespace

SerialScanLine::SerialScanLine(const std::string& path, bool echo, const Clock& clock)
    : path_(path),
      port_({.path = path, .format = kAtFirst, .pty = {.foreign = IsPtyByNumber(path)}}, clock),
      medium_(port_, clock, echo, nullptr) {}

std::string SerialScanLine::Open() {
  std::string problem = port_.Open();
  if (problem.empty()) return problem;
  const std::string holder = PortHolder(path_);
  return holder.empty() ? problem : problem + " (" + holder + " has it open)";
}

bool SerialScanLine::Set(const ProbeTrial& trial) {
  const bool set = port_.SetFormat(trial.line);
  bool lost = false;
  for (int i = 0; i < kMaxReads && !lost; ++i) {  // what came at the rate before
    const Event* stray = medium_.FindStray();
    if (stray == nullptr) break;
    lost = stray->kind == Event::Kind::kLinkDown;
  }
  return set || lost;  // of a lost line the next step tells
}

}  // namespace axlecast
