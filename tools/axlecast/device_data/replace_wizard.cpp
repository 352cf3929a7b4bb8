#include "tools/axlecast/device_data/replace_wizard.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <axlecast/device_info_t.hpp>
#include <fstream>
#include <iostream>
#include <iterator>
#include <utility>

#include "bridge/store/history.h"
#include "core/base/result.h"
#include "core/base/text.h"
#include "core/device/operation.h"
#include "core/messages/enum_names.h"
#include "platform/os/new_file.h"
#include "tools/axlecast/command/command_run.h"
#include "tools/axlecast/command/format_journal.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/device_data/device_access.h"
#include "tools/axlecast/live/format_device.h"
#include "tools/monitor/live_machine.h"

namespace axlecast {
namespace {

constexpr MonoNs kLook = 3 * kSecond;  // DEVICE comes once a second

// Returns true if the device is online or degraded and its DEVICE message was received.
bool Answers(const DeviceView& device, MonoNs now) {
  if (!device.info) return false;
  const auto state = device.State(now);
  return state == device_info_t::STATE_ONLINE || state == device_info_t::STATE_DEGRADED;
}

std::string StateText(const DeviceView& device, MonoNs now) {
  const auto state = device.State(now);
  if (!state) return "SILENT (no message from its driver)";
  const std::string reason = device.info ? Printable(device.info->reason) : "";
  return std::string(DeviceStateName(*state)) + (reason.empty() ? "" : " (" + reason + ")");
}

// "identity 17, serial SN0042, model ts5669n127"
std::string EncoderText(const device_info_t& info) {
  std::string text = "identity " + (info.identity < 0 ? std::string("unknown") : std::to_string(info.identity));
  if (!info.serial.empty()) text += ", serial " + Printable(info.serial);
  if (!info.firmware.empty()) text += ", firmware " + Printable(info.firmware);
  return text + ", model " + Printable(info.model);
}

void PrintAlarms(const DeviceView& device) {
  for (const alarm_entry_t& alarm : device.alarms.entries()) {
    std::cerr << "  alarm " << Printable(alarm.name) << ": " << Printable(alarm.action) << '\n';
  }
}

int Stopped(const CommandResult& result) {
  std::cerr << ToText(result);
  return ExitCode(result);
}

bool Done(const CommandResult& result) {
  const int exit_code = ExitCode(result);
  return exit_code == kExitDone || exit_code == kExitUnverifiable;
}

}  // namespace

void ExchangeWatch::On(std::optional<std::int8_t> state, std::int64_t boot_id, MonoNs now) {
  // A new encoder may come with alarms of its own, such as a battery that was never connected: DEGRADED.
  const bool answers = state == device_info_t::STATE_ONLINE || state == device_info_t::STATE_DEGRADED;
  const bool restarted = boot_id != 0 && boot_id_ != 0 && boot_id != boot_id_;
  if (boot_id != 0) boot_id_ = boot_id;
  if (!answers || restarted) {
    stage_ = Stage::kAway;
    answers_since_ = kNever;
  }
  if (!answers) return;
  if (answers_since_ == kNever) answers_since_ = now;
  if (stage_ == Stage::kAway && now - answers_since_ >= kSteady) stage_ = Stage::kBack;
}

ReplaceWizard::ReplaceWizard(const MachineConfig& machine, ReplaceOptions options)
    : machine_(machine),
      family_(*machine.BusOf(options.command.device)->family),
      options_(std::move(options)),
      client_(machine, options_.command.key, !options_.command.json) {
  report_.device = options_.command.device;
  report_.has_position = family_.has_position;
}

int ReplaceWizard::Run() {
  if (const auto ready = client_.state(); !ready) return Fail(ready.error().text, kExitBad);
  ShowKnown();
  if (const End end = LoadBackup()) {
    report_.stopped = options_.from;
    return *end;
  }
  const std::pair<ReplaceStep, End (ReplaceWizard::*)()> steps[] = {
      {ReplaceStep::kBackup, &ReplaceWizard::Backup},
      {ReplaceStep::kExchange, &ReplaceWizard::Exchange},
      {ReplaceStep::kAccept, &ReplaceWizard::Accept},
      {ReplaceStep::kWriteBack, &ReplaceWizard::WriteBack},
      {ReplaceStep::kDatum, &ReplaceWizard::SetDatum}};
  for (const auto& [step, run] : steps) {
    if (step < options_.from) continue;
    report_.stopped = step;
    if (CancelOnSignal::requested()) return kExitRejected;
    if (const End end = (this->*run)()) return *end;
  }
  report_.stopped.reset();
  return report_.datum ? ExitCode(*report_.datum) : kExitDone;
}

DeviceView ReplaceWizard::Look() {
  LiveMachine live(machine_, clock_);
  const std::string& name = report_.device;
  const auto known = [&name](const MachineView& view) {
    const DeviceView& device = *view.FindDevice(name);
    return (device.Received() && (device.position || !device.has_position) && device.alarms.received()) ||
           CancelOnSignal::requested();
  };
  if (const auto gathered = live.Gather(clock_.Now() + kLook, known); !gathered) {
    std::cerr << gathered.error().text << '\n';
  }
  return *live.view().FindDevice(name);
}

CommandRequest ReplaceWizard::Request(const char* operation) const {
  return {.device = report_.device,
          .operation = operation,
          .valid_ms = options_.command.valid_ms,
          .reason = options_.command.reason};
}

bool ReplaceWizard::Agreed() const { return options_.command.yes || Confirmed(); }

void ReplaceWizard::ShowKnown() {
  const DeviceView device = Look();
  const MonoNs now = clock_.Now();
  std::cerr << PresentText(device, now) << '\n'
            << "  state " << StateText(device, now) << '\n'
            << "  " << (device.info ? EncoderText(*device.info) : "its identity is unknown") << '\n';
  HistoryReader reader(JournalFile(machine_));
  const std::vector<DeviceRecord> devices = reader.Devices();
  const auto found = std::find_if(devices.begin(), devices.end(),
                                  [&](const DeviceRecord& record) { return record.device == report_.device; });
  if (found != devices.end()) std::cerr << DatumText(*found, WriteBudget(machine_, report_.device));
  if (!reader.state()) {
    std::cerr << "  datum and wear are not known here: " << reader.state().error().text << '\n';
  }
}

ReplaceWizard::End ReplaceWizard::LoadBackup() {
  if (options_.backup.empty()) return std::nullopt;
  std::ifstream stream(options_.backup, std::ios::binary);
  if (!stream.is_open()) {
    if (options_.from == ReplaceStep::kBackup) return std::nullopt;
    return Fail("cannot read " + options_.backup, kExitBad);
  }
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  Result<ContentsFile> file = ParseContents(family_, options_.backup, text);
  if (!file) return Fail(file.error().text, kExitBad);
  if (!file->device.empty() && file->device != report_.device) {
    std::cerr << "warning: " << options_.backup << " is a backup of " << file->device << '\n';
  }
  backup_ = std::move(file->contents);
  report_.backup = options_.backup;
  return std::nullopt;
}

ReplaceWizard::End ReplaceWizard::Backup() {
  if (backup_) {
    std::cerr << "backup: " << options_.backup << " exists, and is not changed\n";
    return std::nullopt;
  }
  if (BackupOperation(family_) == nullptr) {
    report_.backup_problem = "devices of " + std::string(family_.name) + " store nothing that can be backed up";
    std::cerr << "backup: " << report_.backup_problem << '\n';
    return std::nullopt;
  }
  const DeviceView device = Look();
  const MonoNs now = clock_.Now();
  if (Answers(device, now)) return ReadBackup();
  report_.backup_problem = "it does not answer, " + StateText(device, now);
  std::cerr << "backup: " << report_.backup_problem << "; continuing without a backup\n";
  return std::nullopt;
}

ReplaceWizard::End ReplaceWizard::ReadBackup() {
  BackupReading reading = ReadContents(client_, family_, options_.command);
  if (ExitCode(reading.result) != kExitDone) return Stopped(reading.result);
  if (!reading.contents) return Fail("backup: " + reading.contents.error().text, kExitFailed);
  const std::string file =
      options_.backup.empty() ? BackupFileName(report_.device, clock_.UtcMicroseconds(), ".txt") : options_.backup;
  if (const Result<> done = WriteOutput(file, reading.text); !done) {
    return Fail(done.error().text, kExitBad);
  }
  backup_ = *std::move(reading.contents);
  report_.backup = file;
  std::cerr << "backup: written to " << file << '\n';
  return std::nullopt;
}

ReplaceWizard::End ReplaceWizard::Exchange() {
  LiveMachine live(machine_, clock_);
  const auto known = [this](const MachineView& view) {
    return view.FindDevice(report_.device)->info || CancelOnSignal::requested();
  };
  Result<> gathered = live.Gather(clock_.Now() + kLook, known);
  std::cerr << "Exchange " << report_.device
            << " now. This waits until it was away and answers again; Ctrl-C stops.\n";
  ExchangeWatch watch;
  std::string reported;
  const auto back = [&](const MachineView& view) {
    const MonoNs now = clock_.Now();
    const DeviceView& device = *view.FindDevice(report_.device);
    watch.On(device.State(now), device.info ? device.info->boot_id : 0, now);
    const std::string state = StateText(device, now);
    if (state != std::exchange(reported, state)) std::cerr << "  " << report_.device << ": " << state << '\n';
    return watch.stage() == ExchangeWatch::Stage::kBack || CancelOnSignal::requested();
  };
  if (gathered) gathered = live.Gather(kNever, back);
  if (!gathered) return Fail(gathered.error().text, kExitBad);
  return watch.stage() == ExchangeWatch::Stage::kBack ? std::nullopt : End(kExitRejected);
}

ReplaceWizard::End ReplaceWizard::Accept() {
  const DeviceView device = Look();
  const MonoNs now = clock_.Now();
  if (!Answers(device, now)) {
    std::cerr << report_.device << " does not answer: " << StateText(device, now)
              << "\nIf the machine's file gives the identity of the old one: change it, restart the driver\n";
    return kExitNoAnswer;
  }
  report_.encoder = EncoderText(*device.info);
  std::cerr << "now answers: " << report_.encoder << ", " << StateText(device, now) << '\n';
  PrintAlarms(device);
  if (!family_.has_position) return std::nullopt;  // a monitor has neither datum nor wear
  std::cerr << "Accept it as another encoder? Its wear, identity and datum start again.\n";
  if (!Agreed()) return kExitRejected;
  report_.accepted = client_.Execute(Request("accept_exchange"));
  return Done(*report_.accepted) ? std::nullopt : End(Stopped(*report_.accepted));
}

ReplaceWizard::End ReplaceWizard::WriteBack() {
  if (!backup_) {
    std::cerr << "write: there is no backup to write back\n";
    return std::nullopt;
  }
  return backup_->values.empty() ? WriteCells() : WriteValues();
}

ReplaceWizard::End ReplaceWizard::WriteCells() {
  const BackupReading present = ReadContents(client_, family_, options_.command);
  if (ExitCode(present.result) != kExitDone) return Stopped(present.result);
  if (!present.contents) return Fail("write: " + present.contents.error().text, kExitFailed);
  const PermittedCells permitted =
      QueryPermitted(client_, options_.command, present.contents->cells, backup_->cells);
  report_.not_permitted = permitted.not_permitted;
  if (permitted.failed) return Stopped(*permitted.failed);
  const std::vector<CellRun> runs = CellRuns(present.contents->cells, permitted.cells, kMaxWrite);
  if (runs.empty()) std::cerr << "write: nothing that may be written differs from the backup\n";
  for (const CellRun& run : runs) {
    if (End end = WriteRun(run)) return end;
  }
  return std::nullopt;
}

ReplaceWizard::End ReplaceWizard::WriteRun(const CellRun& run) {
  std::cerr << "write: address " << run.address << ": " << HexText(run.before) << " -> " << HexText(run.after)
            << '\n';
  if (!Agreed()) return CancelOnSignal::requested() ? End(kExitRejected) : std::nullopt;
  report_.written.push_back(axlecast::WriteCells(client_, options_.command, run));
  return Done(report_.written.back()) ? std::nullopt : End(Stopped(report_.written.back()));
}

ReplaceWizard::End ReplaceWizard::WriteValues() {
  const ParameterReading present = ReadParameters(client_, family_, options_.command);
  if (ExitCode(present.result) != kExitDone) return Stopped(present.result);
  if (!present.values) return Fail("write: " + present.values.error().text, kExitFailed);
  const ParameterChanges changes = ParameterDiff(*present.values, backup_->values);
  std::cerr << "write: " << changes.size() << " parameters differ from the backup\n" << ToText(changes);
  if (changes.empty()) return std::nullopt;
  if (!Agreed()) return CancelOnSignal::requested() ? End(kExitRejected) : std::nullopt;
  report_.written = WriteParameters(client_, options_.command, changes);
  return Done(report_.written.back()) ? std::nullopt : End(Stopped(report_.written.back()));
}

std::string ReplaceWizard::AskValue() const {
  for (std::string answer; !CancelOnSignal::requested();) {
    std::cerr << "What does the axis read now, in its unit? (empty: it stays without datum) ";
    if (!std::getline(std::cin, answer) || answer.empty()) return "";
    if (CLI::Number(answer).empty()) return answer;
    std::cerr << Printable(answer) << " is no number\n";
  }
  return "";
}

ReplaceWizard::End ReplaceWizard::SetDatum() {
  if (!family_.has_position) return std::nullopt;
  const std::string value = options_.value.empty() && !options_.command.yes ? AskValue() : options_.value;
  if (CancelOnSignal::requested()) return kExitRejected;
  if (value.empty()) return std::nullopt;
  CommandRequest request = Request("set_datum");
  request.arguments = {{"value", value}};
  report_.datum = client_.Execute(request);
  return Done(*report_.datum) ? std::nullopt : End(Stopped(*report_.datum));
}

}  // namespace axlecast
