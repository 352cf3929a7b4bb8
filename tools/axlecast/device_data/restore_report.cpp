#include "tools/axlecast/device_data/restore_report.h"

#include <array>

#include "core/base/text.h"
#include "core/device/operation.h"
#include "core/device/parameter.h"
#include "tools/axlecast/command/command_report.h"
#include "tools/axlecast/common/exit_code.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

std::string_view StateName(RestoreLine::State state) {
  static constexpr std::array<std::string_view, 4> kNames = {"not_written", "written", "failed", "impossible"};
  return kNames.at(static_cast<std::size_t>(state));
}

std::string ValueOf(const ParameterSpec& parameter, std::uint16_t raw) {
  return ParameterText(parameter, raw) + ' ' + std::string(parameter.unit);
}

}  // namespace

RestoreLine LineOf(const CellRun& run) {
  const std::size_t last = run.address + run.after.size() - 1;
  std::string what = "eeprom " + std::to_string(run.address);
  if (last != run.address) what += '-' + std::to_string(last);
  return {.what = std::move(what), .before = HexText(run.before), .after = HexText(run.after), .text = ""};
}

RestoreLine LineOf(const ParameterChange& change) {
  return {.what = std::string(change.parameter->name),
          .before = ValueOf(*change.parameter, change.before),
          .after = ValueOf(*change.parameter, change.after),
          .text = ""};
}

void Settle(RestoreLine& line, const CommandResult& result) {
  const int exit_code = ExitCode(result);
  const bool done = exit_code == kExitDone || exit_code == kExitUnverifiable;
  line.state = done ? RestoreLine::State::kDone : RestoreLine::State::kFailed;
  if (!done) line.text = result.problem.empty() ? Printable(result.status.text) : result.problem;
}

std::string ToText(const RestoreReport& report) {
  if (!report.compared) return "";
  std::string text =
      report.device + ": " + std::to_string(report.lines.size()) + " differences from " + report.file + '\n';
  for (const RestoreLine& line : report.lines) {
    text += "  " + Left(StateName(line.state), 12) + line.what + ": " + line.before + " -> " + line.after +
            (line.text.empty() ? "" : ": " + line.text) + '\n';
  }
  for (const std::string& kept : report.kept) text += "  not written back: " + kept + '\n';
  if (report.reads_back) {
    text += *report.reads_back ? "read back: as in the backup\n" : "read back: it still differs from the backup\n";
  }
  return text;
}

Json ToJson(const RestoreReport& report) {
  Json json = {{"device", report.device},
               {"file", report.file},
               {"other_unit", report.other_unit.empty() ? Json() : Json(report.other_unit)},
               {"dry_run", report.dry_run},
               {"differences", Json::array()},
               {"not_written_back", report.kept},
               {"reads_back", report.reads_back ? Json(*report.reads_back) : Json()}};
  for (const RestoreLine& line : report.lines) {
    json["differences"].push_back({{"what", line.what},
                                   {"before", line.before},
                                   {"after", line.after},
                                   {"outcome", StateName(line.state)},
                                   {"text", line.text}});
  }
  return json;
}

}  // namespace axlecast
