#pragma once

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/base/result.h"

namespace axlecast {

// Returns the command line as its parser has it. Man pages, completion and the reference in docs/ are generated from it, so
// that they agree with the program. A command is
//   {"name", "description", "footer", "options": [...], "arguments": [...], "commands": [...]}
// and an option or argument
//   {"names", "description", "value", "limits", "choices", "least", "most", "required", "default", "needs", "excludes"}
// without those that do not apply: a flag has no `value`, and `most` is absent if the number of values is not limited.
[[nodiscard]] nlohmann::ordered_json CliTree(const CLI::App& app);

// Adds the hidden option --cli-tree, which prints the tree of `app` and ends as --help does.
void AddCliTreeOption(CLI::App& app);

// Fails for an unknown subcommand, also of a subcommand (`param lst`): "there is no command 'statsu'; did you mean
// 'status'?". Other errors of the command line are left to the parser.
[[nodiscard]] Result<> CheckCommands(const CLI::App& app, const std::vector<std::string>& words);

}  // namespace axlecast
