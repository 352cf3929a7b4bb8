#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>
#include <vector>

#include "client/axlecast/command.h"
#include "core/base/result.h"
#include "core/config/machine_config.h"
#include "core/device/operation.h"
#include "tools/axlecast/common/config_option.h"

namespace axlecast {

// From the words of a command line to a request: the common options, the operation and its arguments.

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

}  // namespace axlecast
