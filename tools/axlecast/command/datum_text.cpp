#include "tools/axlecast/command/datum_text.h"

#include <algorithm>

#include "core/base/text.h"
#include "core/command/command_id.h"
#include "core/messages/enum_names.h"
#include "tools/axlecast/command/history_text.h"
#include "tools/axlecast/common/utc_text.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

std::string Shown(const std::string& text) { return CappedText(text, text.size()); }

std::string DatumLine(const DatumRecord& datum) {
  return std::to_string(datum.number) + ": " + (datum.value.empty() ? "" : "read " + Shown(datum.value) + ", ") +
         "counts " + std::to_string(datum.counts) + " are 0, set " + UtcText(datum.utime) + " UTC by " +
         Shown(datum.who) + ", command " + ShortId(datum.command) +
         (datum.reason.empty() ? "" : ": " + Shown(datum.reason));
}

std::string WearLine(const AxisRecord& axis, std::int64_t write_budget) {
  std::string text = std::to_string(axis.writes) + (axis.writes == 1 ? " write" : " writes");
  if (axis.since_utime != 0) text += " since " + UtcText(axis.since_utime) + " UTC";
  if (write_budget > 0) {
    const double share = 100.0 * static_cast<double>(axis.writes) / static_cast<double>(write_budget);
    text += ", " + Decimal(share, 2) + " % of " + std::to_string(write_budget);
  }
  return text;
}

Json ToJson(const DatumRecord& datum) {
  return {{"number", datum.number},
          {"counts", datum.counts},
          {"utime", datum.utime},
          {"value", datum.value},
          {"identity", datum.identity},
          {"who", datum.who},
          {"command", datum.command == CommandId{} ? Json() : Json(IdText(datum.command))},
          {"reason", datum.reason}};
}

std::string StateText(const DatumHistory& entry) {
  if (entry.datum.voided_utime != 0) {
    return "void since " + UtcText(entry.datum.voided_utime) + ": " + Shown(entry.datum.void_reason);
  }
  return entry.in_force ? "in force" : "replaced";
}

std::string Row(const std::string& number, const std::string& time, const std::string& value,
                const std::string& counts, const std::string& who, const std::string& id, const std::string& rest) {
  return Right(number, 6) + ' ' + Left(time, 19) + ' ' + Right(value, 16) + ' ' + Right(counts, 14) + ' ' +
         Left(who, 10) + ' ' + Left(id, 8) + ' ' + rest + '\n';
}

}  // namespace

std::int64_t WriteBudget(const MachineConfig& machine, std::string_view device) {
  const BusConfig* bus = machine.BusOf(device);
  if (bus == nullptr) return 0;
  const auto found = std::find_if(bus->devices.begin(), bus->devices.end(),
                                  [device](const DeviceConfig& config) { return config.name == device; });
  return found == bus->devices.end() || !found->settings ? 0 : found->settings->write_budget;
}

std::string DatumText(const DeviceRecord& device, std::int64_t write_budget) {
  const AxisRecord& axis = device.axis;
  std::string text = Shown(device.device) + "\n  datum      " + (axis.datum ? DatumLine(*axis.datum) : "none") +
                     "\n  reference  " + (axis.reference_lost ? "LOST" : "not lost") + "\n  position   ";
  text += axis.position ? "counts " + std::to_string(axis.position->counts) + " at " +
                              UtcText(axis.position->utime) + " UTC, before the datum"
                        : "unknown";
  text += "\n  wear       " + WearLine(axis, write_budget) + '\n';
  if (!axis.identity.empty()) text += "  encoder    " + Shown(axis.identity) + '\n';
  return text;
}

Json DatumJson(const DeviceRecord& device, std::int64_t write_budget) {
  const AxisRecord& axis = device.axis;
  Json position;
  if (axis.position) position = {{"counts", axis.position->counts}, {"utime", axis.position->utime}};
  return {{"device", device.device},
          {"identity", axis.identity},
          {"datum", axis.datum ? ToJson(*axis.datum) : Json()},
          {"reference_lost", axis.reference_lost},
          {"position", position},
          {"writes", axis.writes},
          {"since_utime", axis.since_utime == 0 ? Json() : Json(axis.since_utime)},
          {"write_budget", write_budget == 0 ? Json() : Json(write_budget)}};
}

std::string DatumHistoryHeading() {
  return Row("number", "set (UTC)", "reading", "counts of 0", "who", "command", "state");
}

std::string DatumHistoryLine(const DatumHistory& entry) {
  const DatumRecord& datum = entry.datum;
  return Row(std::to_string(datum.number), UtcText(datum.utime), Printable(datum.value),
             std::to_string(datum.counts), Printable(datum.who), ShortId(datum.command),
             StateText(entry) + (datum.reason.empty() ? "" : " (" + Shown(datum.reason) + ")"));
}

Json DatumHistoryJson(const std::string& device, const DatumHistory& entry) {
  Json json = {{"device", device}};
  json.update(ToJson(entry.datum));
  json["in_force"] = entry.in_force;
  const bool is_void = entry.datum.voided_utime != 0;
  json["voided_utime"] = is_void ? Json(entry.datum.voided_utime) : Json();
  json["voided_why"] = is_void ? Json(entry.datum.void_reason) : Json();
  return json;
}

}  // namespace axlecast
