#include "tools/axlecast/setup/scan_progress.h"

#include <unistd.h>

#include <cmath>
#include <iostream>

#include "platform/os/terminal_output.h"
#include "tools/scan/format_scan.h"

namespace axlecast {
namespace {

constexpr MonoNs kRedraw = 200 * kMillisecond;
constexpr const char* kClearLine = "\r\x1b[K";

std::string WhatOf(const PlannedTrial& planned, ScanLineKind kind) {
  const std::string line = LineText(planned.trial, kind);
  const char* how = planned.trial.asks ? "asking" : "listening";
  return std::string(how) + (line.empty() ? "" : " at " + line) + ": " + planned.trial.what;
}

}  // namespace

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

}  // namespace axlecast
