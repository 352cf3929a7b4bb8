#pragma once

#include <string>

#include "core/base/clock.h"
#include "tools/scan/scan.h"

namespace axlecast {

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

}  // namespace axlecast
