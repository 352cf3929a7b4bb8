#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <string>

#include "core/base/spelling.h"
#include "core/base/text.h"
#include "platform/os/secret_file.h"
#include "tools/axlecast/common/subcommands.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/fleet/fleet_connection.h"
#include "tools/fleet/read/fleet_admin.h"
#include "tools/fleet/read/fleet_reader.h"
#include "tools/fleet/ship/ship_state.h"

namespace axlecast {
namespace {

struct AdminOptions {
  FleetConnection database;
  std::string machine;
  std::string value;  // the second argument
  std::string state;
  bool flag = false;  // --here, --remove, --no-check
  bool remove = false;
};

constexpr const char* kAdminExitCodes =
    "Exit code: 0 done, 6 no server answers, 1 no right or no such machine, 2 usage.\n";

// Reads the installation of this computer. `folder`: the state folder of its `axlecast ship`, which may be running.
Result<Installation> ReadInstallation(const std::string& folder) {
  const std::string file = folder + "/installation.json";
  std::ifstream in(file, std::ios::binary);
  if (!in) {
    return Failure(file + ": " + std::strerror(errno) +
                   ": run `axlecast ship` here once, or name its state folder with --state");
  }
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const auto read = ParseInstallation(text);
  if (!read) return Failure(file + ' ' + read.error().text);
  return *read;
}

using Action = std::function<int(FleetReader&, const AdminOptions&)>;

// Connects for writing, and executes the action.
void RunAdmin(CLI::App& command, const std::shared_ptr<AdminOptions>& options, int& exit_code,
              const Action& action) {
  options->database.AddTo(command);
  command.callback([options, &exit_code, action] {
    const auto settings = options->database.Settings(true);
    if (!settings) {
      exit_code = Fail(settings.error().text, kExitUsage);
      return;
    }
    SecretFiles secrets;
    FleetReader reader(*settings, secrets);
    exit_code = action(reader, *options);
  });
}

int Done(const std::string& text) {
  static_cast<void>(WriteOut(text + '\n'));
  return kExitDone;
}

int Rename(FleetReader& reader, const AdminOptions& options) {
  if (!IsName(options.value)) return Fail(Quoted(options.value) + kNameRule, kExitUsage);
  const auto machine = reader.OpenMachine(options.machine);
  if (!machine) return FailReader(reader, machine.error());
  if (Result<> renamed = RenameMachine(reader, *machine, options.value); !renamed)
    return FailReader(reader, renamed.error());
  Result<> renamed = reader.Open();
  if (renamed) renamed = RenameShard(reader, options.machine, options.value);
  if (!renamed) {
    return Fail("the machine is renamed, but not its row in the table of shards: " + renamed.error().text +
                    "\nRun `axlecast fleet shard " + options.value + " CONNECTION` and `axlecast fleet shard " +
                    options.machine + " --remove`",
                kExitBad);
  }
  return Done(options.machine + " is now " + options.value + ". Change `machine` in its file as well");
}

int Adopt(FleetReader& reader, const AdminOptions& options) {
  std::string installation = options.value;
  if (options.flag) {
    const auto here = ReadInstallation(options.state.empty() ? DefaultShipState() : options.state);
    if (!here) return Fail(here.error().text, kExitBad);
    installation = here->id;
  }
  if (installation.empty()) return Fail("add --here, or --installation UUID", kExitUsage);
  if (!IsUuid(installation)) return Fail("--installation: " + Quoted(installation) + " is not a UUID", kExitUsage);
  const auto machine = reader.OpenMachine(options.machine);
  if (!machine) return FailReader(reader, machine.error());
  if (Result<> adopted = AdoptMachine(reader, *machine, installation); !adopted)
    return FailReader(reader, adopted.error());
  return Done(options.machine + " is now shipped by installation " + installation);
}

int Shard(FleetReader& reader, const AdminOptions& options) {
  if (options.remove == !options.value.empty()) return Fail("state either CONNECTION or --remove", kExitUsage);
  if (!IsName(options.machine)) return Fail(Quoted(options.machine) + kNameRule, kExitUsage);
  if (!options.remove && !options.flag) {
    if (Result<> opened = reader.OpenOther(options.value); !opened) {
      return Fail("the shard cannot be used: " + opened.error().text + "\nAdd --no-check to set it all the same",
                  kExitBad);
    }
  }
  if (Result<> opened = reader.Open(); !opened) return FailReader(reader, opened.error());
  if (options.remove) {
    const auto removed = RemoveShard(reader, options.machine);
    if (!removed) return FailReader(reader, removed.error());
    return *removed ? Done(options.machine + " is shipped to this database from now on")
                    : Fail("the table of shards has no machine " + Quoted(options.machine), kExitBad);
  }
  if (Result<> set = SetShard(reader, options.machine, options.value); !set) return FailReader(reader, set.error());
  return Done(options.machine +
              " is shipped to the shard from now on. Rows that are in this database already stay here");
}

std::string RetentionText(const std::vector<RetentionRule>& rules) {
  std::string text;
  for (const RetentionRule& rule : rules) {
    text +=
        Left(rule.kind, 20) + ' ' + (rule.keep_us ? FormatTime(*rule.keep_us * kMicrosecond) : "unlimited") + '\n';
  }
  return text;
}

int Retention(FleetReader& reader, const AdminOptions& options) {
  std::optional<MonoNs> keep;
  if (!options.value.empty() && options.value != "unlimited") {
    keep = ParseTime(options.value);
    constexpr MonoNs kDay = 86'400 * kSecond;
    if (!keep || *keep < kDay)
      return Fail(Quoted(options.value) + " is not a time of at least 1d, or `unlimited`", kExitUsage);
  }
  if (Result<> opened = reader.Open(); !opened) return FailReader(reader, opened.error());
  if (!options.value.empty()) {
    const RetentionRule rule{options.machine, keep ? std::optional(*keep / kMicrosecond) : std::nullopt};
    if (Result<> set = SetRetention(reader, rule); !set) return FailReader(reader, set.error());
  }
  const auto rules = ReadRetention(reader);
  if (!rules) return FailReader(reader, rules.error());
  static_cast<void>(WriteOut(RetentionText(*rules)));
  return kExitDone;
}

int RunExpire(FleetReader& reader, const AdminOptions&) {
  if (Result<> opened = reader.Open(); !opened) return FailReader(reader, opened.error());
  const auto expired = Expire(reader);
  if (!expired) return FailReader(reader, expired.error());
  std::string text;
  for (const Expired& one : *expired) {
    text += one.kind + ": " + std::to_string(one.partitions) + " partitions and " + std::to_string(one.rows) +
            " rows deleted\n";
  }
  static_cast<void>(WriteOut(text.empty() ? "nothing is older than its retention\n" : text));
  return kExitDone;
}

void AddRename(CLI::App& fleet, int& exit_code) {
  auto options = std::make_shared<AdminOptions>();
  CLI::App* command = fleet.add_subcommand("rename", "Rename a machine in the database, with its history");
  command->add_option("OLD", options->machine, "The machine's name")->required();
  command->add_option("NEW", options->value, "Its new name")->required();
  command->footer(std::string("Rename it before its file is shipped under the new name.\n"
                              "example:\n"
                              "  axlecast fleet rename press3 hall2-press3\n") +
                  kConnectionHelp + kAdminExitCodes);
  RunAdmin(*command, options, exit_code, &Rename);
}

void AddAdopt(CLI::App& fleet, int& exit_code) {
  auto options = std::make_shared<AdminOptions>();
  CLI::App* command = fleet.add_subcommand("adopt", "Accept a machine from another computer");
  command->add_option("MACHINE", options->machine, "The machine")->required();
  CLI::Option* installation =
      command->add_option("--installation", options->value, "The installation that ships it from now on")
          ->type_name("UUID");
  CLI::Option* here =
      command->add_flag("--here", options->flag, "Use the installation of this computer")->excludes(installation);
  command->add_option("--state", options->state, "Read the installation from this state folder of `axlecast ship`")
      ->type_name("FOLDER")
      ->needs(here);
  command->footer(
      std::string(
          "The database accepts a machine from one installation only, so that two machines with one name do not "
          "mix. The shipper\n"
          "of the old computer is refused from now on.\n"
          "examples:\n"
          "  axlecast fleet adopt press3 --here\n"
          "  axlecast fleet adopt press3 --installation 0f0e9b5c-7c1b-4d7f-9d0b-2f4f3f1f9f11\n") +
      kConnectionHelp + kAdminExitCodes);
  RunAdmin(*command, options, exit_code, &Adopt);
}

void AddShard(CLI::App& fleet, int& exit_code) {
  auto options = std::make_shared<AdminOptions>();
  CLI::App* command = fleet.add_subcommand("shard", "Set the server that a machine is shipped to");
  command->add_option("MACHINE", options->machine, "The machine")->required();
  command->add_option("CONNECTION", options->value, "The connection to the server, without a password");
  command->add_flag("--remove", options->remove, "Ship the machine to this database again");
  command->add_flag("--no-check", options->flag, "Do not connect to the server first");
  command->footer(
      std::string(
          "Its shipper and `axlecast fleet` look here first, and connect to the shard then. Rows that exist stay "
          "where they are.\n"
          "examples:\n"
          "  axlecast fleet shard press3 \"host=db3,db4 dbname=axlecast user=axlecast_press\"\n"
          "  axlecast fleet shard press3 --remove\n") +
      kConnectionHelp + kAdminExitCodes);
  RunAdmin(*command, options, exit_code, &Shard);
}

void AddRetention(CLI::App& fleet, int& exit_code) {
  auto options = std::make_shared<AdminOptions>();
  CLI::App* command = fleet.add_subcommand("retention", "Show or set for how long the database keeps rows");
  CLI::Option* kind = command->add_option("KIND", options->machine, "The table, for example position_chunk");
  command->add_option("TIME", options->value, "Keep its rows for this time, at least 1d; `unlimited`: without end")
      ->needs(kind);
  command->footer(std::string("Rows are deleted by `axlecast fleet expire`.\n"
                              "examples:\n"
                              "  axlecast fleet retention\n"
                              "  axlecast fleet retention position_chunk 30d\n"
                              "  axlecast fleet retention alarm unlimited\n") +
                  kConnectionHelp + kAdminExitCodes);
  RunAdmin(*command, options, exit_code, &Retention);
}

void AddExpire(CLI::App& fleet, int& exit_code) {
  auto options = std::make_shared<AdminOptions>();
  CLI::App* command = fleet.add_subcommand("expire", "Delete rows that are older than their retention");
  command->footer(std::string("Run it about once an hour (docs/fleet.md). Whole partitions are dropped.\n"
                              "example:\n"
                              "  axlecast fleet expire\n") +
                  kConnectionHelp + kAdminExitCodes);
  RunAdmin(*command, options, exit_code, &RunExpire);
}

}  // namespace

void AddFleetAdminCommands(CLI::App& fleet, int& exit_code) {
  AddRename(fleet, exit_code);
  AddAdopt(fleet, exit_code);
  AddShard(fleet, exit_code);
  AddRetention(fleet, exit_code);
  AddExpire(fleet, exit_code);
}

}  // namespace axlecast
