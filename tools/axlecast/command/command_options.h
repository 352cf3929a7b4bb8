#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "tools/axlecast/command/command_run.h"
#include "tools/axlecast/common/config_option.h"

namespace axlecast {

inline constexpr const char* kCommandExitCodes =
    "exit code: 0 done and verified, 2 usage, 3 rejected, expired or cancelled, 4 failed, 5 indeterminate, "
    "6 no answer, 7 done but not verifiable";

// What every command to a device takes: --config, --key, --json, --valid-ms, --epoch, --reason; --yes where it asks
// first.
void AddCommandOptions(CLI::App& command, ConfigOption& config, CommandOptions& wish, bool asks);

// --reason.
void AddReasonOption(CLI::App& command, std::string& reason);

// --key.
void AddKeyOption(CLI::App& command, std::string& key);

// A number alone, for a value in the device's own unit. Of "100mm" it says to leave the unit out.
[[nodiscard]] CLI::Validator PlainNumber();

// What a command that is one operation takes besides: --prepare and --commit.
void AddTwoStepOptions(CLI::App& command, CommandOptions& wish);

}  // namespace axlecast
