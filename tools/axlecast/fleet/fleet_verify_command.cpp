#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "core/base/spelling.h"
#include "core/base/utc_text.h"
#include "platform/os/secret_file.h"
#include "tools/axlecast/common/subcommands.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/fleet/fleet_connection.h"
#include "tools/axlecast/logs/log_input.h"
#include "tools/fleet/position_chunk.h"
#include "tools/fleet/read/fleet_reader.h"
#include "tools/fleet/read/log_check.h"
#include "tools/fleet/ship/log_head.h"

namespace axlecast {
namespace {

struct VerifyOptions {
  FleetConnection database;
  std::vector<std::string> files;
  std::string machine;
  bool quick = false;
  bool complete = false;
  bool json = false;
};

// Verifies logs, connected to the server of one machine at a time.
class Verification {
 public:
  Verification(db::DatabaseSettings settings, SecretSource& secrets, const VerifyOptions& options)
      : reader_(std::move(settings), secrets), options_(options) {}

  // Prints the result. Returns the exit code.
  [[nodiscard]] int Verify(const std::string& file);

 private:
  // Connects to the server of the machine, unless it is connected to it.
  [[nodiscard]] Result<FleetMachine> Machine(const std::string& name);

  FleetReader reader_;
  const VerifyOptions& options_;
  std::optional<FleetMachine> machine_;
};

Result<FleetMachine> Verification::Machine(const std::string& name) {
  if (!machine_ || machine_->name != name) {
    machine_.reset();
    auto machine = reader_.OpenMachine(name);
    if (!machine) return machine;
    machine_ = *std::move(machine);
  }
  return *machine_;
}

int Verification::Verify(const std::string& file) {
  LogInput input;
  if (!input.Open(file)) return kExitBad;
  const auto head = ReadLogHead(input.log());
  if (!head) return Fail(file + ": " + head.error().text, kExitBad);
  const auto config = MachineOf(input.log(), file);
  if (!config) return Fail(config.error().text, kExitBad);
  const auto machine = Machine(options_.machine.empty() ? config->machine : options_.machine);
  if (!machine) return FailReader(reader_, machine.error());
  const auto entry = FindLog(reader_, *machine, head->key);
  if (!entry) return FailReader(reader_, entry.error());
  if (!*entry) {
    Show({{"file", file}, {"equal", false}, {"differences", {"the database has nothing of this log"}}},
         file + ": the database has nothing of this log\n", options_.json);
    return kExitLosses;
  }
  auto odd = ReadOddEvents(reader_, **entry);
  if (!odd) return FailReader(reader_, odd.error());
  LogDigest log((*entry)->upto, config->lcm.prefix, *std::move(odd));
  const auto gaps = ReadGaps(reader_, **entry);
  if (!gaps) return FailReader(reader_, gaps.error());
  input.Read("verifying", [](const LogEvent&, std::size_t) { return true; });
  if (const int exit_code = input.ExitCode(); exit_code == kExitBad) return exit_code;
  log.AddLog(input.log(), *gaps);
  auto database =
      options_.quick ? ReadSampleCounts(reader_, *machine, **entry) : ReadDigests(reader_, *machine, **entry);
  if (!database) return FailReader(reader_, database.error());
  const auto details = ShippedDetails(*config, head->key.name, log.devices());
  const LogComparison comparison = Compare({.log = log,
                                            .ledger = **entry,
                                            .database = *database,
                                            .details = details,
                                            .content = !options_.quick,
                                            .complete = options_.complete});
  Show(ComparisonJson(file, comparison), DamageText(file, input.damage()) + ComparisonText(file, comparison),
       options_.json);
  return comparison.differences.empty() ? kExitDone : kExitLosses;
}

int RunFleetVerify(VerifyOptions& options) {
  const auto settings = options.database.Settings(false);
  if (!settings) return Fail(settings.error().text, kExitUsage);
  SecretFiles secrets;
  Verification verification(*settings, secrets, options);
  int exit_code = kExitDone;
  for (const std::string& file : options.files) {
    const int of_log = verification.Verify(file);
    if (exit_code != kExitBad && of_log != kExitDone) exit_code = of_log;
  }
  return exit_code;
}

}  // namespace

void AddFleetVerifyCommand(CLI::App& fleet, int& exit_code) {
  auto options = std::make_shared<VerifyOptions>();
  CLI::App* command = fleet.add_subcommand("verify", "Compare logs with what the database has of them");
  command->add_option("LOG", options->files, "The logs of axlecast record")->required()->expected(1, -1);
  command->add_option("--machine", options->machine, "The machine in the database, if it was renamed")
      ->type_name("NAME");
  command->add_flag("--quick", options->quick, "Compare numbers only, and not the content of the positions");
  command->add_flag("--complete", options->complete, "Events that are not in the database yet are a difference");
  command->add_flag("--json", options->json, "Print one JSON object per log");
  options->database.AddTo(*command);
  command->footer(std::string("Compares events, bytes and the CRC of the seals with the ledger, and time, counts "
                              "and flags of every position "
                              "with the\n"
                              "database, up to the event that was shipped last.\n"
                              "examples:\n"
                              "  axlecast fleet verify press3-positions_20261121T070000Z.lcm\n"
                              "  axlecast fleet verify --complete logs/*.lcm\n") +
                  kConnectionHelp +
                  "Exit code: 0 equal, 3 different, 6 no server answers, 1 a log cannot be read, 2 usage.\n");
  command->callback([options, &exit_code] { exit_code = RunFleetVerify(*options); });
}

}  // namespace axlecast
