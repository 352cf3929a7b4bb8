#include "tools/axlecast/device_data/restore_run.h"

#include <algorithm>
#include <array>
#include <iostream>
#include <utility>

#include "core/base/text.h"
#include "core/device/operation.h"
#include "core/device/parameter.h"
#include "tools/axlecast/command/command_run.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/device_data/device_access.h"

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

int Stopped(const CommandResult& result) {
  std::cerr << ToText(result);
  return ExitCode(result);
}

bool IsDone(int exit_code) { return exit_code == kExitDone || exit_code == kExitUnverifiable; }

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

RestoreRun::RestoreRun(const MachineConfig& machine, RestoreOptions options)
    : family_(*machine.BusOf(options.command.device)->family),
      options_(std::move(options)),
      client_(machine, options_.command.key, !options_.command.json) {
  report_.device = options_.command.device;
  report_.file = options_.file;
  report_.dry_run = options_.dry_run;
}

int RestoreRun::Refuse(const std::string& problem, int exit_code) const {
  std::cerr << report_.device << ": " << problem << '\n';
  return exit_code;
}

int RestoreRun::Run(const DeviceBackup& backup, const device_info_t& info) {
  if (const auto ready = client_.state(); !ready) return Refuse(ready.error().text, kExitBad);
  if (const int exit_code = CheckUnit(backup, info); exit_code != kExitDone) return exit_code;
  Result<BackupContents> wanted = ContentsOf(backup, family_);
  if (!wanted) return Refuse(wanted.error().text, kExitBad);
  wanted_ = *std::move(wanted);
  ListKept(backup);
  report_.compared = BackupOperation(family_) == nullptr;
  if (report_.compared) return kExitDone;
  BackupContents present;
  if (const int exit_code = Read(present); exit_code != kExitDone) return exit_code;
  if (const int exit_code = Compare(present); exit_code != kExitDone) return exit_code;
  report_.compared = true;
  if (!AnyPending() || options_.dry_run) return kExitDone;
  std::cerr << ToText(report_);
  if (!options_.command.yes && !Confirmed()) return kExitRejected;
  const int written = Write();
  const int read_back = CancelOnSignal::requested() ? kExitRejected : ReadBack();
  return IsDone(written) ? read_back : written;
}

int RestoreRun::CheckUnit(const DeviceBackup& backup, const device_info_t& info) {
  if (backup.family != family_.name || backup.model != Printable(info.model)) {
    return Refuse("it is a " + std::string(family_.name) + ' ' + Printable(info.model) +
                      ", and the backup is of a " + Printable(backup.family) + ' ' + Printable(backup.model) +
                      ": nothing of it would fit",
                  kExitRejected);
  }
  report_.other_unit = OtherUnit(backup, info);
  if (report_.other_unit.empty()) return kExitDone;
  if (!options_.to_another_unit) {
    return Refuse("it is another unit: " + report_.other_unit + "; if that is meant: --to-another-unit",
                  kExitRejected);
  }
  return kExitDone;
}

void RestoreRun::ListKept(const DeviceBackup& backup) {
  report_.kept.emplace_back("identity, serial, firmware: fixed in the device");
  if (!backup.datum.is_null()) {
    report_.kept.emplace_back("datum: it is in software, and the bridge stores it (axlecast datum show " +
                              report_.device + "); another unit needs its own: axlecast home");
  }
  if (!backup.alarms.empty()) report_.kept.emplace_back("alarms: the device reports them, but does not store them");
  if (BackupOperation(family_) == nullptr) {
    report_.kept.emplace_back("memory, parameters: devices of " + std::string(family_.name) +
                              " keep nothing that could be read and written");
  }
}

int RestoreRun::Read(BackupContents& present) {
  BackupReading reading = ReadContents(client_, family_, options_.command);
  if (ExitCode(reading.result) != kExitDone) return Stopped(reading.result);
  if (!reading.contents) return Refuse(reading.contents.error().text, kExitFailed);
  present = *std::move(reading.contents);
  return kExitDone;
}

int RestoreRun::Compare(const BackupContents& present) {
  const PermittedCells permitted = QueryPermitted(client_, options_.command, present.cells, wanted_.cells);
  if (permitted.failed) return Stopped(*permitted.failed);
  runs_ = CellRuns(present.cells, permitted.cells, kMaxWrite);
  changes_ = ParameterDiff(present.values, wanted_.values);
  for (const CellRun& run : runs_) report_.lines.push_back(LineOf(run));
  for (const ParameterChange& change : changes_) report_.lines.push_back(LineOf(change));
  for (const std::size_t address : permitted.not_permitted) {
    RestoreLine line = LineOf(
        CellRun{.address = address, .before = {present.cells.at(address)}, .after = {wanted_.cells.at(address)}});
    line.state = RestoreLine::State::kImpossible;
    line.text = "the machine's file does not list the address under eeprom_writable";
    report_.lines.push_back(std::move(line));
  }
  return kExitDone;
}

bool RestoreRun::AnyPending() const { return !runs_.empty() || !changes_.empty(); }

int RestoreRun::Write() {
  const int exit_code = WriteMemory();
  return IsDone(exit_code) ? WriteValues() : exit_code;
}

int RestoreRun::WriteMemory() {
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    if (CancelOnSignal::requested()) return kExitRejected;
    const CommandResult result = WriteCells(client_, options_.command, runs_[i]);
    Settle(report_.lines[i], result);
    if (!IsDone(ExitCode(result))) return Stopped(result);
  }
  return kExitDone;
}

int RestoreRun::WriteValues() {
  std::size_t line = runs_.size();
  const std::vector<CommandRequest> requests = WriteRequests(options_.command, changes_);
  for (const CommandRequest& request : requests) {
    if (CancelOnSignal::requested()) return kExitRejected;
    const CommandResult result = client_.Execute(request);
    for (std::size_t i = 0; i < request.arguments.size(); ++i) Settle(report_.lines[line++], result);
    if (!IsDone(ExitCode(result))) return Stopped(result);
  }
  return kExitDone;
}

int RestoreRun::ReadBack() {
  BackupContents present;
  if (const int exit_code = Read(present); exit_code != kExitDone) return exit_code;
  const std::size_t differ =
      CellRuns(present.cells, wanted_.cells, 1).size() + ParameterDiff(present.values, wanted_.values).size();
  const auto impossible = std::count_if(report_.lines.begin(), report_.lines.end(), [](const RestoreLine& line) {
    return line.state == RestoreLine::State::kImpossible;
  });
  report_.reads_back = differ == static_cast<std::size_t>(impossible);
  return *report_.reads_back ? kExitDone : kExitFailed;
}

}  // namespace axlecast
