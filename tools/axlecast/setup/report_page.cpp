#include "tools/axlecast/setup/report_page.h"

#include <array>
#include <cmath>
#include <cstdio>

#include "core/messages/json/names.h"
#include "tools/axlecast/command/format_journal.h"
#include "tools/axlecast/common/utc_text.h"
#include "tools/axlecast/setup/line_findings.h"
#include "tools/service/html_page.h"
#include "tools/service/redacted_config.h"

namespace axlecast {
namespace {

using Row = HtmlPage::Row;

std::string TimeText(std::int64_t utime) { return utime == 0 ? "never" : UtcText(utime); }

std::string PerMillion(std::int64_t failed, std::int64_t exchanges) {
  if (exchanges <= 0) return "";
  std::array<char, 32> text{};
  static_cast<void>(std::snprintf(text.data(), text.size(), "%.1f",
                                  1e6 * static_cast<double>(failed) / static_cast<double>(exchanges)));
  return text.data();
}

void AddHead(HtmlPage& page, const MachineConfig& machine, const ReportContents& contents) {
  page.Facts({{{"machine"}, {machine.machine}},
              {{"time (UTC)"}, {UtcText(contents.utime)}},
              {{"host"}, {contents.host}},
              {{"kernel"}, {contents.kernel}},
              {{"axlecast"}, {AXLECAST_VERSION}},
              {{"LCM"}, {machine.lcm.url}},
              {{"commands"}, {machine.lcm.command_url}}});
}

HtmlPage::Cell State(std::string_view word, bool heard, bool good) {
  if (!heard) return {"not heard", "attention"};
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
    page.Paragraph("The journal knows of no device yet.");
}

void AddTrend(HtmlPage& page, const ReportContents& contents) {
  page.Heading("Failed exchanges of each cable and adapter");
  std::string from;
  for (const std::string& log : contents.logs) from += (from.empty() ? "" : ", ") + log;
  page.Paragraph(from.empty() ? "Since the start of each driver; --log FILE shows the hours of a recording."
                              : "By hours, from " + from + ".");
  if (contents.trend.buses().empty()) page.Paragraph("Nothing is known.");
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

}  // namespace

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

}  // namespace axlecast
