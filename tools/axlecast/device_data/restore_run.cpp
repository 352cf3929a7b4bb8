#include "tools/axlecast/device_data/restore_run.h"

#include <algorithm>
#include <iostream>
#include <utility>

#include "core/base/text.h"
#include "tools/axlecast/command/command_report.h"
#include "tools/axlecast/common/cancel_on_signal.h"
#include "tools/axlecast/common/confirmation.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/device_data/memory_transfer.h"
#include "tools/axlecast/device_data/parameter_transfer.h"

namespace axlecast {
namespace {

int Stopped(const CommandResult& result) {
  std::cerr << ToText(result);
  return ExitCode(result);
}

bool IsDone(int exit_code) { return exit_code == kExitDone || exit_code == kExitUnverifiable; }

}  // namespace

RestoreRun::RestoreRun(const MachineConfig& machine, RestoreWish wish)
    : family_(*machine.BusOf(wish.command.device)->family),
      wish_(std::move(wish)),
      client_(machine, wish_.command.key, !wish_.command.json) {
  report_.device = wish_.command.device;
  report_.file = wish_.file;
  report_.dry_run = wish_.dry_run;
}

int RestoreRun::Refuse(const std::string& problem, int exit_code) const {
  std::cerr << report_.device << ": " << problem << '\n';
  return exit_code;
}

int RestoreRun::Run(const DeviceBackup& backup, const device_info_t& info) {
  if (!client_.problem().empty()) return Refuse(client_.problem(), kExitBad);
  if (const int exit_code = CheckUnit(backup, info); exit_code != kExitDone) return exit_code;
  std::string problem;
  wanted_ = ContentsOf(backup, family_, problem);
  if (!problem.empty()) return Refuse(problem, kExitBad);
  ListKept(backup);
  report_.compared = BackupOperation(family_) == nullptr;
  if (report_.compared) return kExitDone;
  BackupContents present;
  if (const int exit_code = Read(present); exit_code != kExitDone) return exit_code;
  if (const int exit_code = Compare(present); exit_code != kExitDone) return exit_code;
  report_.compared = true;
  if (!AnyPending() || wish_.dry_run) return kExitDone;
  std::cerr << ToText(report_);
  if (!wish_.command.yes && !Confirmed()) return kExitRejected;
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
  if (!wish_.to_another_unit) {
    return Refuse("it is another unit: " + report_.other_unit + "; if that is meant: --to-another-unit",
                  kExitRejected);
  }
  return kExitDone;
}

void RestoreRun::ListKept(const DeviceBackup& backup) {
  report_.kept.emplace_back("identity, serial, firmware: the device's own, nobody writes them");
  if (!backup.datum.is_null()) {
    report_.kept.emplace_back("datum: it is in software, and the bridge keeps it (axlecast datum show " +
                              report_.device + "); another unit needs its own: axlecast home");
  }
  if (!backup.alarms.empty()) report_.kept.emplace_back("alarms: they are what the device says, not what it holds");
  if (BackupOperation(family_) == nullptr) {
    report_.kept.emplace_back("memory, parameters: devices of " + std::string(family_.name) +
                              " keep nothing that could be read and written");
  }
}

int RestoreRun::Read(BackupContents& present) {
  BackupReading reading = ReadBackup(client_, family_, wish_.command);
  if (ExitCode(reading.result) != kExitDone) return Stopped(reading.result);
  if (!reading.problem.empty()) return Refuse(reading.problem, kExitFailed);
  present = std::move(reading.contents);
  return kExitDone;
}

int RestoreRun::Compare(const BackupContents& present) {
  const PermittedCells permitted = AskPermitted(client_, wish_.command, present.cells, wanted_.cells);
  if (permitted.failed) return Stopped(*permitted.failed);
  runs_ = CellRuns(present.cells, permitted.cells, kLongestWrite);
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
    const CommandResult result = WriteCells(client_, wish_.command, runs_[i]);
    Settle(report_.lines[i], result);
    if (!IsDone(ExitCode(result))) return Stopped(result);
  }
  return kExitDone;
}

int RestoreRun::WriteValues() {
  std::size_t line = runs_.size();
  const std::vector<CommandRequest> requests = WriteRequests(wish_.command, changes_);
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
