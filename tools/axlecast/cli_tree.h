#pragma once

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace axlecast {

// The command line as its parser has it: what man pages, completion and the reference in docs/ are made of, so that none
// can say what the program does not do. A command is
//   {"name", "description", "footer", "options": [...], "arguments": [...], "commands": [...]}
// and an option or argument
//   {"names", "description", "value", "limits", "choices", "least", "most", "required", "default", "needs", "excludes"}
// where what does not apply is absent: a flag has no `value`, and `most` is absent where any number may follow.
[[nodiscard]] nlohmann::ordered_json CliTree(const CLI::App& app);

// Adds the hidden option --cli-tree, which prints the tree of `app` and ends as --help does.
void AddCliTreeOption(CLI::App& app);

// What is wrong with a command line in which a word that should be a command is none: "no command 'statsu'; did you mean
// 'status'?". Also for the commands of a command (`param lst`). Empty: each is one, or something else is wrong.
[[nodiscard]] std::string UnknownCommand(const CLI::App& app, const std::vector<std::string>& words);

}  // namespace axlecast
