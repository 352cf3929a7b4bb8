#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "client/axlecast/command_client.h"
#include "core/config/machine_config.h"
#include "tools/axlecast/command/command_request.h"
#include "tools/axlecast/common/terminal.h"

namespace axlecast {

// Returns how to reach the bridge of `machine`, and the key that signs: `key_file`, else $AXLECAST_KEY, else the first
// readable key of the machine's file (of `role`, if given), else none.
[[nodiscard]] ClientSettings OperatorSettings(const MachineConfig& machine, const std::string& key_file,
                                              std::optional<Role> role = std::nullopt);

// Sends the commands of an operator, one after another. Ctrl-C cancels the current command and all later ones.
class OperatorClient {
 public:
  // `key_file`: see OperatorSettings. With `show_progress`, the progress is printed to standard error.
  OperatorClient(const MachineConfig& machine, const std::string& key_file, bool show_progress);

  // Why no command can be sent and how to fix it; empty if commands can be sent.
  [[nodiscard]] std::string problem() const { return ErrorText(client_.state()); }

  // Sends the command and returns its outcome. Waits at most for its validity plus one minute.
  [[nodiscard]] CommandResult Execute(const CommandRequest& request);
  [[nodiscard]] CommandResult Query(const CommandId& id);

 private:
  CommandClient client_;
  CancelOnSignal cancel_;
};

// Checks the command, asks for confirmation if needed, executes it and prints its outcome. Returns the exit code.
[[nodiscard]] int RunCommand(const MachineConfig& machine, const CommandOptions& options);

// Queries the bridge for the state of the command `id` and prints it. Returns the exit code.
[[nodiscard]] int RunQuery(const MachineConfig& machine, const CommandId& id, bool json);

// Returns the exit code of an outcome (kCommandExitCodes).
[[nodiscard]] int ExitCode(const CommandResult& result);

// Returns one flat object: `outcome` and `reason` as words, the fields of command_status_t, and, where they apply:
// `temporary` if the command was refused, `found` if it is indeterminate, `problem` if there is no outcome.
[[nodiscard]] nlohmann::ordered_json ToJson(const CommandResult& result);

// Formats the outcome, the changes and what to do next, in several lines.
[[nodiscard]] std::string ToText(const CommandResult& result);

}  // namespace axlecast
