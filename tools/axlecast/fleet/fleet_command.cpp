#include <CLI/CLI.hpp>

#include "tools/axlecast/common/subcommands.h"

namespace axlecast {

void AddFleetCommand(CLI::App& app, int& exit_code) {
  CLI::App* const fleet = app.add_subcommand("fleet", "The database that has the history of many machines");
  fleet->require_subcommand(1);
  for (const auto add : {&AddFleetInitCommand, &AddFleetUpCommand, &AddFleetStatusCommand, &AddFleetQueryCommand,
                         &AddFleetFetchCommand, &AddFleetVerifyCommand, &AddFleetAdminCommands}) {
    add(*fleet, exit_code);
  }
  fleet->footer("axlecast ship writes the database; docs/fleet.md describes it.\n");
}

}  // namespace axlecast
