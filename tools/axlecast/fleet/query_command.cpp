#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/base/spelling.h"
#include "platform/os/secret_file.h"
#include "tools/axlecast/common/subcommands.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/fleet/fleet_connection.h"
#include "tools/axlecast/fleet/fleet_times.h"
#include "tools/fleet/read/event_query.h"
#include "tools/fleet/read/fleet_reader.h"
#include "tools/fleet/read/position_query.h"
#include "tools/fleet/read/table_writer.h"

namespace axlecast {
namespace {

struct QueryOptions {
  FleetConnection database;
  FleetTimeOptions time;
  std::string kind;
  std::string machine;
  std::string device;
  std::string format = "csv";
  std::int64_t limit = 0;
  bool full = false;
  bool message = false;
};

const std::map<std::string, TableFormat> kFormats = {
    {"csv", TableFormat::kCsv}, {"json", TableFormat::kJson}, {"jsonl", TableFormat::kJsonl}};

std::vector<std::string> Kinds() {
  std::vector<std::string> kinds = {"positions", "seconds", "minutes"};
  for (const EventTable& table : EventTables()) kinds.emplace_back(table.kind);
  return kinds;
}

// Returns the table of the kind; null for positions, seconds and minutes.
const EventTable* FindEventTable(const std::string& kind) {
  const auto tables = EventTables();
  const auto found = std::ranges::find_if(tables, [&](const EventTable& table) { return table.kind == kind; });
  return found == tables.end() ? nullptr : &*found;
}

// Returns why the options do not fit together; empty: they do.
std::string BadOption(const QueryOptions& options, const EventTable* events) {
  if (options.full && options.kind != "positions") return "--full is for positions only";
  if (options.message && (events == nullptr || *events->message == 0))
    return options.kind + " have no message: remove --message";
  if (!options.device.empty() && events != nullptr && *events->device == 0) {
    return options.kind + " belong to a machine, not to a device: remove --device";
  }
  return "";
}

std::vector<std::string> ColumnsOf(const QueryOptions& options, const EventTable* events) {
  if (events != nullptr) return EventColumns(*events, options.message);
  return options.kind == "positions" ? PositionColumns(options.full) : RollupColumns();
}

Result<QueryResult> WriteRows(FleetReader& reader, const FleetMachine& machine, const QueryOptions& options,
                              const QueryTimes& times, const EventTable* events, TableWriter& table) {
  if (events != nullptr) {
    return WriteEvents(
        reader, machine, *events,
        {.times = times, .device = options.device, .message = options.message, .limit = options.limit}, table);
  }
  const auto devices = reader.Devices(machine, options.device);
  if (!devices) return Failure(devices.error());
  const PositionQuery query{.times = times, .full = options.full, .limit = options.limit};
  if (options.kind == "positions") return WritePositions(reader, *devices, query, table);
  return WriteRollups(reader, *devices, options.kind == "seconds" ? RollupSpan::kSeconds : RollupSpan::kMinutes,
                      query, table);
}

int RunQuery(QueryOptions& options) {
  const EventTable* const events = FindEventTable(options.kind);
  if (const std::string bad = BadOption(options, events); !bad.empty()) return Fail(bad, kExitUsage);
  const auto settings = options.database.Settings(false);
  if (!settings) return Fail(settings.error().text, kExitUsage);
  const auto name = options.database.MachineName(options.machine);
  if (!name) return Fail(name.error().text, kExitUsage);
  SecretFiles secrets;
  FleetReader reader(*settings, secrets);
  const auto machine = reader.OpenMachine(*name);
  if (!machine) return FailReader(reader, machine.error());
  const auto times = options.time.Parse(reader, *machine);
  if (!times) return Fail(times.error().text, kExitUsage);
  TableWriter table(kFormats.at(options.format), ColumnsOf(options, events),
                    [](std::string_view piece) { return WriteOut(piece); });
  const auto result = WriteRows(reader, *machine, options, *times, events, table);
  const bool written = table.End();
  if (!written) return kExitDone;  // the reader has what it needs
  if (!result) return FailReader(reader, result.error());
  if (result->damaged == 0) return kExitDone;
  return Fail(std::to_string(result->damaged) +
                  " chunks cannot be decoded, their samples are missing above; the first: " + result->first_damage,
              kExitLosses);
}

}  // namespace

void AddFleetQueryCommand(CLI::App& fleet, int& exit_code) {
  auto options = std::make_shared<QueryOptions>();
  CLI::App* command = fleet.add_subcommand("query", "Print a machine's history as CSV or JSON");
  command->add_option("KIND", options->kind, "What to print")->required()->check(CLI::IsMember(Kinds()));
  command->add_option("--machine", options->machine, "The machine; without it, that of the machine's file")
      ->type_name("NAME");
  command->add_option("--device", options->device, "Print only the rows of this device")->type_name("NAME");
  options->time.AddTo(*command);
  command->add_option("--format", options->format, "How to print")
      ->check(CLI::IsMember({"csv", "json", "jsonl"}))
      ->capture_default_str();
  command->add_option("--limit", options->limit, "Print at most N rows; 0: all")
      ->check(CLI::Range(std::int64_t{0}, INT64_MAX))
      ->type_name("N");
  command->add_flag("--full", options->full, "Print every field of positions; empty where less detail was shipped");
  command->add_flag("--message", options->message, "Print the whole message of each event as well");
  options->database.AddTo(*command);
  command->footer(
      std::string("Positions, seconds and minutes are printed device by device, by time; other kinds by time. "
                  "utime is in us, "
                  "UNIX time.\n"
                  "examples:\n"
                  "  axlecast fleet query positions --machine press3 --device axis1 --from 2026-11-21T07:00 "
                  "--until 2026-11-21T07:05\n"
                  "  axlecast fleet query minutes --machine press3 --from -1d --format json\n"
                  "  axlecast fleet query alarms --machine press3 --from -7d > alarms.csv\n") +
      kConnectionHelp +
      "Exit code: 0 all rows, 3 some positions cannot be decoded, 6 no server answers, 1 no such machine, 2 "
      "usage.\n");
  command->callback([options, &exit_code] { exit_code = RunQuery(*options); });
}

}  // namespace axlecast
