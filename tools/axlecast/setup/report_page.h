#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bridge/store/history.h"
#include "core/config/machine_config.h"
#include "tools/monitor/machine_view.h"
#include "tools/service/acceptance_result.h"
#include "tools/service/error_trend.h"

namespace axlecast {

// What a report was made of.
struct ReportContents {
  std::string host;
  std::string kernel;
  std::int64_t utime = 0;             // us, UNIX time, of the report
  std::vector<DeviceRecord> records;  // of the journal
  std::string journal_problem;        // why there are none
  Findings reads;                     // a group for each device; empty: nothing was read
  ErrorTrend trend;
  std::vector<std::string> logs;  // that the trend is from; empty: what was heard
};

// The whole report as a page. Pure. `now`: of the view.
[[nodiscard]] std::string ReportPage(const MachineConfig& machine, const MachineView& view, MonoNs now,
                                     const ReportContents& contents);

}  // namespace axlecast
