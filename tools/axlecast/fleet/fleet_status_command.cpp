#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "core/base/spelling.h"
#include "platform/os/secret_file.h"
#include "tools/axlecast/common/subcommands.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/fleet/fleet_connection.h"
#include "tools/fleet/read/fleet_reader.h"
#include "tools/fleet/read/fleet_status.h"

namespace axlecast {
namespace {

struct StatusOptions {
  FleetConnection database;
  std::string machine;
  std::string late = "60s";
  std::string holes = "1d";
  bool json = false;
};

Result<std::vector<ServerStatus>> ReadMachine(FleetReader& reader, const std::string& name,
                                              const StatusLimits& limits) {
  if (const auto machine = reader.OpenMachine(name); !machine) return Failure(machine.error());
  auto status = ReadServerStatus(reader, name, limits);
  if (!status) return Failure(status.error());
  return std::vector{*std::move(status)};
}

// Reads the database and each shard. A shard that does not answer is part of the result.
Result<std::vector<ServerStatus>> ReadAll(FleetReader& reader, const StatusLimits& limits) {
  if (Result<> opened = reader.Open(); !opened) return Failure(opened.error());
  const auto shards = reader.Shards();
  if (!shards) return Failure(shards.error());
  auto own = ReadServerStatus(reader, "", limits);
  if (!own) return Failure(own.error());
  std::vector<ServerStatus> servers = {*std::move(own)};
  for (const std::string& shard : *shards) {
    const Result<> opened = reader.OpenOther(shard);
    auto status = opened ? ReadServerStatus(reader, "", limits) : Failure(opened.error());
    if (!status) {
      servers.push_back(
          {.host = shard, .identity = {}, .error = status.error().text, .tables = {}, .machines = {}});
    } else if (std::ranges::none_of(
                   servers, [&](const ServerStatus& server) { return server.identity == status->identity; })) {
      servers.push_back(*std::move(status));  // one that is a shard itself is read once
    }
  }
  return servers;
}

bool NeedsAttention(const ServerStatus& server, const StatusLimits& limits) {
  return !server.error.empty() || std::ranges::any_of(server.machines, [&](const MachineStatus& machine) {
    return NeedsAttention(machine, server.now, limits);
  });
}

Result<StatusLimits> LimitsOf(const StatusOptions& options) {
  const auto late = ParseTime(options.late);
  if (!late) return Failure("--late: " + Quoted(options.late) + " is not " + kTimeRule);
  const auto holes = ParseTime(options.holes);
  if (!holes) return Failure("--holes: " + Quoted(options.holes) + " is not " + kTimeRule);
  return StatusLimits{.late_us = *late / kMicrosecond, .holes_us = *holes / kMicrosecond};
}

int RunFleetStatus(StatusOptions& options) {
  const auto limits = LimitsOf(options);
  if (!limits) return Fail(limits.error().text, kExitUsage);
  const auto settings = options.database.Settings(false);
  if (!settings) return Fail(settings.error().text, kExitUsage);
  SecretFiles secrets;
  FleetReader reader(*settings, secrets);
  const auto servers =
      options.machine.empty() ? ReadAll(reader, *limits) : ReadMachine(reader, options.machine, *limits);
  if (!servers) return FailReader(reader, servers.error());
  Show(FleetStatusJson(*servers, *limits), FleetStatusText(*servers, *limits), options.json);
  const bool attention =
      std::ranges::any_of(*servers, [&](const ServerStatus& server) { return NeedsAttention(server, *limits); });
  return attention ? kExitLosses : kExitDone;
}

}  // namespace

void AddFleetStatusCommand(CLI::App& fleet, int& exit_code) {
  auto options = std::make_shared<StatusOptions>();
  CLI::App* command =
      fleet.add_subcommand("status", "Show how up to date the database is with each machine, and its size");
  command->add_option("MACHINE", options->machine, "Show only this machine");
  command->add_option("--late", options->late, "A machine is late if its newest message is older than TIME")
      ->type_name("TIME")
      ->capture_default_str();
  command->add_option("--holes", options->holes, "A hole is new if it was noticed within TIME")
      ->type_name("TIME")
      ->capture_default_str();
  command->add_flag("--json", options->json, "Print one JSON object");
  options->database.AddTo(*command);
  command->footer(
      std::string(
          "AGE is the server's time minus the time of the newest message. LAG and LOGS are what waits on the "
          "machine. HOLES are\n"
          "messages that will never be in the database. ODD are messages whose time is out of range. "
          "SAMPLES/S is the rate of the\n"
          "last whole minute. DISK FREE is of the machine's disk, as its recorder reports it.\n"
          "examples:\n"
          "  axlecast fleet status\n"
          "  axlecast fleet status press3 --late 10m\n"
          "  axlecast fleet status --json | jq '.servers[].machines[] | select(.late)'\n") +
      kConnectionHelp +
      "Exit code: 0 good, 3 a machine is late or has new holes, or a shard does not answer, 1 no connection or no "
      "such\nmachine, 2 usage.\n");
  command->callback([options, &exit_code] { exit_code = RunFleetStatus(*options); });
}

}  // namespace axlecast
