#include "tools/fleet/ship/ship_status.h"

#include <algorithm>

#include "core/alarm/alarm_codes.h"
#include "core/base/spelling.h"
#include "core/base/text.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kDetail = 80;  // bytes of an alarm's action

// Returns why messages of the machine cannot be read now; empty if all can.
std::string Unreadable(const ShipStatus& status) {
  if (!status.problems.folder.empty()) return status.problems.folder;
  const auto log = std::ranges::find(status.skipped, false, &SkippedLog::foreign);
  return log == status.skipped.end() ? "" : log->file + ": " + log->reason;
}

std::string Megabytes(std::int64_t bytes) { return Text("%.1f MB", static_cast<double>(bytes) / 1e6); }

}  // namespace

std::string ShipProblems::Text() const {
  std::string text;
  for (const std::string* const problem : {&database, &folder, &marks, &retention}) {
    if (!text.empty() && !problem->empty()) text += "; ";
    text += *problem;
  }
  return text;
}

Json ShipStatusJson(const std::string& machine, const char* state, std::int64_t utime, const ShipStatus& status) {
  Json skipped = Json::array();
  for (const SkippedLog& log : status.skipped)
    skipped.push_back({{"file", log.file}, {"reason", log.reason}, {"foreign", log.foreign}});
  return {{"state", state},
          {"machine", machine},
          {"utime", utime},
          {"connected", status.connected},
          {"host", status.host},
          {"problem", status.problems.Text()},
          {"fenced", status.fenced},
          {"batches", status.batches},
          {"bytes", status.bytes},
          {"samples", status.samples},
          {"events", status.events},
          {"odd", status.odd},
          {"holes", status.holes},
          {"lag_s", static_cast<double>(status.lag_us) / 1e6},
          {"oldest_s", static_cast<double>(status.oldest_us) / 1e6},
          {"lag_bytes", status.lag_bytes},
          {"lag_logs", status.lag_logs},
          {"skipped", skipped}};
}

std::string ShipStatusLine(const ShipStatus& status) {
  std::string text = status.connected ? "connected to " + status.host : "no connection to the database";
  if (status.lag_logs > 0) {
    text += Text(", %.0f s behind, ", static_cast<double>(status.lag_us) / 1e6) + Megabytes(status.lag_bytes) +
            " in " + std::to_string(status.lag_logs) + (status.lag_logs == 1 ? " log" : " logs") + " not shipped";
  }
  text += "; shipped " + std::to_string(status.samples) + " samples, " + std::to_string(status.events) +
          " events, " + Megabytes(status.bytes);
  const auto add = [&text](std::int64_t count, const char* of) {
    if (count > 0) text += "; " + std::to_string(count) + ' ' + of;
  };
  add(status.holes, "holes");
  add(status.odd, "messages with odd times");
  add(static_cast<std::int64_t>(status.skipped.size()), "files skipped");
  if (const std::string problems = status.problems.Text(); !problems.empty()) text += "; " + problems;
  return text;
}

std::string ShipAlarmName(const std::string& machine) { return "ship/" + machine; }

const alarm_t& ShipAlarms::Make(const ShipStatus& status, MonoNs now, std::int64_t utime) {
  using namespace shipping_alarms;
  const bool away = !status.connected && !status.fenced && now - status.away_since >= kAway;
  alarms_.Set(kDatabaseAway, away, utime, false,
              away ? Shortened(status.problems.database, kDetail) : std::string_view());
  const std::string unreadable = Unreadable(status);
  if (unreadable.empty()) {
    unreadable_since_.reset();
  } else if (!unreadable_since_) {
    unreadable_since_ = now;
  }
  const bool not_read = unreadable_since_ && now - *unreadable_since_ >= kUnreadable;
  alarms_.Set(kLogsNotShipped, not_read || status.oldest_us >= kLate, utime, false,
              not_read ? Shortened(unreadable, kDetail) : std::string_view());
  alarms_.Set(kHoleRecorded, status.holes > holes_before_, utime, status.holes > 0);
  alarms_.Set(kShipperFenced, status.fenced, utime);
  holes_before_ = status.holes;
  return alarms_.Make({now, utime});
}

}  // namespace axlecast
