#include "tools/axlecast/unknown_command.h"

#include <algorithm>
#include <optional>

#include "core/base/spelling.h"

namespace axlecast {
namespace {

std::vector<const CLI::App*> CommandsOf(const CLI::App& app) {
  std::vector<const CLI::App*> commands = app.get_subcommands([](const CLI::App*) { return true; });
  std::erase_if(commands, [](const CLI::App* command) { return command->get_name().empty(); });
  return commands;
}

bool TakesArguments(const CLI::App& app) {
  const std::vector<const CLI::Option*> options = app.get_options();
  return std::any_of(options.begin(), options.end(),
                     [](const CLI::Option* option) { return option->get_positional(); });
}

std::string Problem(const std::string& path, const std::vector<const CLI::App*>& commands,
                    const std::string& word) {
  std::vector<std::string> names;
  names.reserve(commands.size());
  for (const CLI::App* command : commands) names.push_back(command->get_name());
  const std::optional<std::string> near = NearestWord(word, names);
  return path + ": there is no command " + Quoted(word) + (near ? "; did you mean " + Quoted(*near) + "?" : "") +
         "\nAll commands: " + path + " --help";
}

}  // namespace

std::string UnknownCommand(const CLI::App& app, const std::vector<std::string>& words) {
  const CLI::App* at = &app;
  std::string path = app.get_name();
  for (const std::string& word : words) {
    const std::vector<const CLI::App*> commands = CommandsOf(*at);
    if (commands.empty() || TakesArguments(*at)) return "";
    if (word.starts_with('-')) continue;  // a flag: commands that have commands take no values
    const auto found = std::find_if(commands.begin(), commands.end(),
                                    [&word](const CLI::App* command) { return command->get_name() == word; });
    if (found == commands.end()) return Problem(path, commands, word);
    at = *found;
    path += ' ' + word;
  }
  return "";
}

}  // namespace axlecast
