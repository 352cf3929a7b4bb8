#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/axlecast/command.h"
#include "client/axlecast/command_client.h"
#include "core/base/result.h"
#include "core/config/machine_config.h"
#include "core/device/operation.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/terminal.h"

namespace axlecast {

// Commands to devices: from the words of a command line to a request, its execution, and its outcome as text.

inline constexpr const char* kCommandExitCodes =
    "exit code: 0 done and verified, 2 usage, 3 rejected, expired or cancelled, 4 failed, 5 indeterminate, "
    "6 no answer, 7 done but not verifiable";

// An operation on a device, as an operator typed it.
struct CommandOptions {
  std::string device;
  std::string operation;
  std::vector<std::string> arguments;  // KEY=VALUE
  std::int32_t valid_ms = 5'000;
  std::int32_t epoch = -1;  // expected datum_epoch; -1: the present one
  std::string reason;
  bool asks = false;     // ask for confirmation although the operation is not destructive
  bool yes = false;      // never ask for confirmation
  bool json = false;     // print the outcome as one JSON object
  std::string key;       // file of the secret key; empty: see OperatorSettings
  bool prepare = false;  // only report what would happen
  std::string commit;    // token of a prepared command, 32 hex digits, or empty
  std::string out;       // file for the bytes that were read, or empty
};

// Adds the options of every command: --config, --key, --json, --valid-ms, --epoch, --reason. Adds --yes if it `asks`.
void AddCommandOptions(CLI::App& command, ConfigOption& config, CommandOptions& options, bool asks);

// Adds --prepare and --commit, for a command that is one operation.
void AddTwoStepOptions(CLI::App& command, CommandOptions& options);

void AddReasonOption(CLI::App& command, std::string& reason);  // --reason
void AddKeyOption(CLI::App& command, std::string& key);        // --key

// Accepts a number without a unit. The error of "100mm" asks to omit the unit.
[[nodiscard]] CLI::Validator PlainNumber();

// Returns the operations of the devices of a bus: those of its family, then those of the runtime.
[[nodiscard]] std::vector<const OperationSpec*> OperationsOf(const BusConfig& bus);

struct FoundOperation {
  const BusConfig* bus;
  const OperationSpec* operation;
};
// Finds an operation of a device. The error lists the valid devices or operations.
[[nodiscard]] Result<FoundOperation> FindOperation(const MachineConfig& machine, const std::string& device,
                                                   const std::string& operation);

// Adds "key=value" words to `request.arguments`. Fails if a word has no '=', or if a key is unknown, repeated or missing.
[[nodiscard]] Result<> SetArguments(const OperationSpec& operation, const std::vector<std::string>& words,
                                    CommandRequest& request);

// Formats the operations, their arguments and effects, for `do DEVICE --list`.
[[nodiscard]] std::string OperationList(const BusConfig& bus);

// Returns how to reach the bridge of `machine`, and the key that signs: `key_file`, else $AXLECAST_KEY, else the first
// readable key of the machine's file (of `role`, if given), else none.
[[nodiscard]] ClientSettings OperatorSettings(const MachineConfig& machine, const std::string& key_file,
                                              std::optional<Role> role = std::nullopt);

// Sends the commands of an operator, one after another. Ctrl-C cancels the current command and all later ones.
class OperatorClient {
 public:
  // `key_file`: see OperatorSettings. With `show_progress`, the progress is printed to standard error.
  OperatorClient(const MachineConfig& machine, const std::string& key_file, bool show_progress);

  // Fails if no command can be sent. The error contains the fix.
  [[nodiscard]] Result<> state() const;

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
