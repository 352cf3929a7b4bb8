#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace axlecast {

// What is wrong with a command line in which a word that should be a command is none: "no command 'statsu'; did you mean
// 'status'?". Also for the commands of a command (`param lst`). Empty: each is one, or something else is wrong.
[[nodiscard]] std::string UnknownCommand(const CLI::App& app, const std::vector<std::string>& words);

}  // namespace axlecast
