#include <sys/utsname.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <cstdint>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "bridge/store/history.h"
#include "core/base/result.h"
#include "core/base/text.h"
#include "core/base/utc_text.h"
#include "core/config/machine_config.h"
#include "core/messages/enum_names.h"
#include "core/messages/message.h"
#include "platform/os/new_file.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/command/format_journal.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/subcommands.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/device_data/device_access.h"
#include "tools/axlecast/logs/log_input.h"
#include "tools/axlecast/setup/line_findings.h"
#include "tools/monitor/live_machine.h"
#include "tools/monitor/machine_view.h"
#include "tools/service/acceptance_result.h"
#include "tools/service/error_trend.h"
#include "tools/service/redacted_config.h"

namespace axlecast {
namespace {

// The contents of a report in addition to the live view.
struct ReportContents {
  std::string host;
  std::string kernel;
  std::int64_t unix_us = 0;           // time of the report
  std::vector<DeviceRecord> records;  // from the journal
  std::string journal_problem;        // why the journal was not read
  Findings reads;                     // a group per device; empty: nothing was read
  ErrorTrend trend;
  std::vector<std::string> logs;  // files of the trend; empty: it is from live messages
};

using Row = HtmlPage::Row;

std::string TimeText(std::int64_t utime) { return utime == 0 ? "never" : UtcText(utime); }

std::string PerMillion(std::int64_t failed, std::int64_t exchanges) {
  return exchanges <= 0 ? "" : Decimal(1e6 * static_cast<double>(failed) / static_cast<double>(exchanges), 1);
}

void AddHead(HtmlPage& page, const MachineConfig& machine, const ReportContents& contents) {
  page.Facts({{{"machine"}, {machine.machine}},
              {{"time (UTC)"}, {UtcText(contents.unix_us)}},
              {{"host"}, {contents.host}},
              {{"kernel"}, {contents.kernel}},
              {{"axlecast"}, {AXLECAST_VERSION}},
              {{"LCM"}, {machine.lcm.url}},
              {{"commands"}, {machine.lcm.command_url}}});
}

HtmlPage::Cell State(std::string_view word, bool received, bool good) {
  if (!received) return {"no message", "attention"};
  return {std::string(word), good ? "good" : "bad"};
}

void AddBuses(HtmlPage& page, const MachineConfig& machine, const MachineView& view, MonoNs now) {
  page.Heading("Buses");
  std::vector<Row> rows;
  for (const BusView& bus : view.buses()) {
    const BusConfig& config = *machine.FindBus(bus.name);
    const auto state = bus.State(now);
    rows.push_back({{bus.name},
                    {std::string(config.family->name)},
                    {config.link.port + (config.simulate ? " (simulated)" : "")},
                    State(state ? BusStateName(*state) : "", state.has_value(), bus.Up(now)),
                    {bus.health ? bus.health->last_error : ""}});
  }
  page.Table({"bus", "family", "port", "state", "last error"}, rows);
  for (const BusConfig& bus : machine.buses) {
    if (!bus.simulate) {
      Findings line = {LineFindings(bus)};
      line.front().title = "Line of " + bus.name;
      AddFindings(page, line);
    }
  }
}

void AddDevice(HtmlPage& page, const DeviceView& device, MonoNs now) {
  page.SubHeading(device.name + " on " + device.bus);
  const auto state = device.State(now);
  std::vector<Row> rows = {
      {{"state"}, State(state ? DeviceStateName(*state) : "", state.has_value(), device.Online(now))}};
  if (device.info) {
    const device_info_t& info = *device.info;
    std::array<std::int64_t, kErrorKinds> errors{};
    std::copy(std::begin(info.errors), std::end(info.errors), errors.begin());
    if (!info.reason.empty()) rows.push_back({{"reason"}, {info.reason}});
    rows.push_back({{"family, model"}, {info.family + ", " + info.model}});
    if (!info.serial.empty()) rows.push_back({{"serial number"}, {info.serial}});
    if (!info.firmware.empty()) rows.push_back({{"firmware"}, {info.firmware}});
    if (info.identity >= 0) rows.push_back({{"identity"}, {std::to_string(info.identity)}});
    rows.push_back({{"good readings since its driver's start"}, {std::to_string(info.good)}});
    rows.push_back({{"failed readings"}, {KindsText(errors)}});
    rows.push_back({{"last good reading (UTC)"}, {TimeText(info.last_good_utime)}});
    if (device.has_position) {
      rows.push_back({{"datum"},
                      {std::to_string(info.datum_counts) + " counts, epoch " + std::to_string(info.datum_epoch) +
                       ", set " + TimeText(info.datum_utime)}});
      rows.push_back(
          {{"reference"},
           {info.reference_lost != 0 ? "lost" : "not lost", info.reference_lost != 0 ? "attention" : ""}});
    }
  }
  page.Facts(rows);
}

void AddAlarms(HtmlPage& page, const MachineView& view) {
  page.Heading("Alarms");
  std::vector<Row> rows;
  const auto add = [&rows](const std::string& of, const std::vector<alarm_entry_t>& alarms) {
    for (const alarm_entry_t& alarm : alarms) {
      const bool serious = alarm.severity >= alarm_entry_t::SEVERITY_ERROR;
      rows.push_back({{of},
                      {alarm.name, serious ? "bad" : "attention"},
                      {std::string(SeverityName(alarm.severity)) + ", " + std::string(AlarmStateName(alarm.state))},
                      {TimeText(alarm.first_utime)},
                      {alarm.action}});
    }
  };
  for (const DeviceView& device : view.devices()) add(device.name, device.alarms.entries());
  add("bridge", view.bridge().entries());
  if (rows.empty()) return page.Paragraph("None.");
  page.Table({"of", "alarm", "how", "since (UTC)", "what to do"}, rows);
}

void AddDatums(HtmlPage& page, const MachineConfig& machine, const ReportContents& contents) {
  page.Heading("Datums and wear, from the bridge's journal");
  if (!contents.journal_problem.empty()) page.Paragraph("Not read: " + contents.journal_problem);
  for (const DeviceRecord& record : contents.records)
    page.Listing(DatumText(record, WriteBudget(machine, record.device)));
  if (contents.journal_problem.empty() && contents.records.empty())
    page.Paragraph("The journal contains no device yet.");
}

void AddTrend(HtmlPage& page, const ReportContents& contents) {
  page.Heading("Failed exchanges of each cable and adapter");
  std::string from;
  for (const std::string& log : contents.logs) from += (from.empty() ? "" : ", ") + log;
  page.Paragraph(from.empty() ? "Since the start of each driver; --log FILE shows the hours of a recording."
                              : "By hours, from " + from + ".");
  if (contents.trend.buses().empty()) page.Paragraph("There is no message of a bus.");
  for (const auto& [name, bus] : contents.trend.buses()) {
    page.SubHeading(name + " (" + bus.port + ")");
    std::vector<Row> rows;
    for (const auto& [span, entry] : bus.entries) {
      rows.push_back({{UtcText(span)},
                      {std::to_string(entry.exchanges), "number"},
                      {std::to_string(entry.Failed()), entry.Failed() > 0 ? "attention" : "number"},
                      {PerMillion(entry.Failed(), entry.exchanges), "number"},
                      {KindsText(entry.errors)},
                      {std::to_string(entry.reopens), "number"},
                      {std::to_string(std::lround(entry.p99_us)), "number"}});
    }
    page.Table({"hour from (UTC)", "exchanges", "failed", "per million", "kinds", "reopened", "p99 (us)"}, rows);
  }
}

// Returns the report as a page. `now`: the time of the view.
std::string ReportPage(const MachineConfig& machine, const MachineView& view, MonoNs now,
                       const ReportContents& contents) {
  HtmlPage page("Machine " + machine.machine);
  AddHead(page, machine, contents);
  AddBuses(page, machine, view, now);
  page.Heading("Devices");
  for (const DeviceView& device : view.devices()) AddDevice(page, device, now);
  AddAlarms(page, view);
  AddDatums(page, machine, contents);
  if (contents.reads.empty()) {
    page.Heading("Parameters and memory");
    page.Paragraph("Not read.");
  } else {
    AddFindings(page, contents.reads);
  }
  AddTrend(page, contents);
  page.Heading("Configuration");
  page.Paragraph("Without comments; passwords are masked.");
  page.Listing(RedactedConfig(machine.text));
  return page.Text();
}

constexpr MonoNs kLongestWait = 6 * kSecond;  // monitors on a full bus are read every few seconds

struct Options {
  ConfigOption config;
  std::string html;
  std::string key;
  std::vector<std::string> logs;
  bool no_reads = false;
};

// Returns false if a log cannot be read, after printing the error.
bool ReadLogs(const Options& options, const std::string& prefix, ReportContents& contents) {
  for (const std::string& file : options.logs) {
    LogInput input;
    if (!input.Open(file)) return false;
    input.Read("reading", [&](const LogEvent& event, std::size_t) {
      if (!event.channel.starts_with(prefix + "BUS/")) return true;
      if (const auto health = DecodeMessage<bus_health_t>(event.data)) contents.trend.OnBus(*health);
      return true;
    });
    if (input.ExitCode() == kExitBad) return false;
    contents.logs.push_back(file);
  }
  return true;
}

// Prints to standard error: standard output may contain the page.
void Progress(const std::string& text) { std::cerr << text << '\n'; }

void ReadDevices(const Options& options, const MachineConfig& machine, ReportContents& contents) {
  OperatorClient client(machine, options.key, false);
  std::size_t devices = 0;
  for (const BusConfig& bus : machine.buses) devices += bus.devices.size();
  std::size_t number = 0;
  for (const BusConfig& bus : machine.buses) {
    for (const DeviceConfig& device : bus.devices) {
      Progress("reading parameters and memory of " + device.name + " (" + std::to_string(++number) + " of " +
               std::to_string(devices) + ")");
      const std::vector<DeviceRead> reads = ReadEverything(client, bus, device.name);
      FindingGroup group = ReadFindings(bus, reads);
      group.title = "Parameters and memory of " + device.name;
      contents.reads.push_back(std::move(group));
      if (!reads.empty() && !reads.back().result.answered) {
        return Progress("no bridge answers: parameters and memory are omitted");
      }
    }
  }
}

void ReadJournal(const MachineConfig& machine, ReportContents& contents) {
  HistoryReader reader(JournalFile(machine));
  contents.records = reader.Devices();
  contents.journal_problem = ErrorText(reader.state());
}

int RunReport(const MachineConfig& machine, const Options& options) {
  const SystemClock clock;
  ReportContents contents;
  if (!ReadLogs(options, machine.lcm.prefix, contents)) return kExitBad;
  Progress("listening to the machine, at most " + std::to_string(kLongestWait / kSecond) + " s");
  LiveMachine live(machine, clock);
  const auto all = [](const MachineView& view) { return view.AllReceived() && view.bridge().received(); };
  if (const Result<> gathered = live.Gather(clock.Now() + kLongestWait, all); !gathered) {
    return Fail(gathered.error().text, kExitFailed);
  }
  const MonoNs received_at = clock.Now();
  for (const BusView& bus : live.view().buses()) {
    if (contents.logs.empty() && bus.health) contents.trend.OnBus(*bus.health);
  }
  utsname system{};
  if (uname(&system) == 0) {
    contents.host = system.nodename;
    contents.kernel = std::string(system.sysname) + ' ' + system.release + ' ' + system.machine;
  }
  contents.unix_us = clock.UtcMicroseconds();
  ReadJournal(machine, contents);
  if (!options.no_reads && !live.view().NothingReceived()) ReadDevices(options, machine, contents);
  const std::string page = ReportPage(machine, live.view(), received_at, contents);
  if (options.html.empty()) return WriteOut(page) ? kExitDone : kExitFailed;
  if (const Result<> written = WriteOutput(options.html, page); !written)
    return Fail(written.error().text, kExitFailed);
  Progress("written: " + options.html);
  return kExitDone;
}

}  // namespace

void AddReportCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command =
      app.add_subcommand("report", "Write the state of the machine as one page, for acceptance and service");
  options->config.AddTo(*command, ConfigOption::Form::kPositional);
  command->add_option("--html", options->html, "Write the page to this file; default standard output")
      ->type_name("FILE");
  command->add_option("--log", options->logs, "Show the errors of this recording by hours; repeat it for more")
      ->type_name("LOG");
  command->add_option("--key", options->key, "Secret key that signs the reads")->type_name("FILE");
  command->add_flag("--no-reads", options->no_reads, "Do not read devices through the bridge");
  command->footer(
      "examples:\n"
      "  axlecast report --html press3.html\n"
      "  axlecast report machine.yaml --log /var/log/axlecast/press3/*.lcm --html press3.html\n"
      "Nothing is written to a device. The page shows what does not run. Passwords are masked.\n"
      "exit code: 0 done, 1 the machine's file or a log is bad, 2 usage, 4 failed");
  RunOnMachine<Options>(*command, options, exit_code, &RunReport);
}

}  // namespace axlecast
