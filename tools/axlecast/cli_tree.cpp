#include "tools/axlecast/cli_tree.h"

#include <algorithm>
#include <iostream>
#include <optional>
#include <set>

#include "core/base/spelling.h"

namespace axlecast {
namespace {

using nlohmann::ordered_json;

std::vector<std::string> Names(const CLI::Option& option) {
  if (option.get_positional()) return {option.get_name(true)};
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) names.push_back('-' + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  return names;
}

// Sorted: the parser keeps them by address.
std::set<std::string> Names(const std::set<CLI::Option*>& options) {
  std::set<std::string> names;
  for (const CLI::Option* option : options) names.insert(Names(*option).back());
  return names;
}

void SetIf(ordered_json& json, const char* key, const std::string& text) {
  if (!text.empty()) json[key] = text;
}

// What the parser calls the type: "FILE", "TEXT:{csv,mcap}", "INT:INT in [1 - 64]".
void SetValue(ordered_json& json, const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const std::size_t colon = type.find(':');
  json["value"] = type.substr(0, colon);
  if (colon == std::string::npos) return;
  const std::string limits = type.substr(colon + 1);
  if (limits.front() == '{' && limits.back() == '}') {
    json["choices"] = CLI::detail::split(limits.substr(1, limits.size() - 2), ',');
  } else {
    json["limits"] = limits;
  }
}

ordered_json OptionTree(const CLI::Option& option) {
  ordered_json json;
  json["names"] = Names(option);
  json["description"] = option.get_description();
  const int maximum = option.get_items_expected_max();
  if (maximum > 0) {
    SetValue(json, option);
    json["least"] = option.get_items_expected_min();
    if (maximum < CLI::detail::expected_max_vector_size) json["most"] = maximum;
  }
  if (option.get_required()) json["required"] = true;
  SetIf(json, "default", option.get_default_str());
  if (const auto needs = Names(option.get_needs()); !needs.empty()) json["needs"] = needs;
  if (const auto excludes = Names(option.get_excludes()); !excludes.empty()) json["excludes"] = excludes;
  return json;
}

std::vector<const CLI::App*> CommandsOf(const CLI::App& app) {
  std::vector<const CLI::App*> commands = app.get_subcommands([](const CLI::App*) { return true; });
  std::erase_if(commands, [](const CLI::App* command) { return command->get_name().empty(); });
  return commands;
}

bool TakesArguments(const CLI::App& app) {
  return std::ranges::any_of(app.get_options(), [](const CLI::Option* option) { return option->get_positional(); });
}

Error UnknownCommand(const std::string& path, const std::vector<const CLI::App*>& commands,
                     const std::string& word) {
  std::vector<std::string> names;
  names.reserve(commands.size());
  for (const CLI::App* command : commands) names.push_back(command->get_name());
  const std::optional<std::string> near = NearestWord(word, names);
  return {path + ": there is no command " + Quoted(word) + (near ? "; did you mean " + Quoted(*near) + "?" : "") +
          "\nAll commands: " + path + " --help"};
}

}  // namespace

ordered_json CliTree(const CLI::App& app) {
  ordered_json json = {{"name", app.get_name()}, {"description", app.get_description()}};
  SetIf(json, "footer", app.get_footer());
  json["options"] = ordered_json::array();
  json["arguments"] = ordered_json::array();
  json["commands"] = ordered_json::array();
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_group().empty()) continue;  // hidden
    json[option->get_positional() ? "arguments" : "options"].push_back(OptionTree(*option));
  }
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    if (!command->get_group().empty()) json["commands"].push_back(CliTree(*command));
  }
  return json;
}

void AddCliTreeOption(CLI::App& app) {
  app.add_flag_callback("--cli-tree",
                        [&app] {
                          std::cout << CliTree(app).dump(1) << '\n';
                          throw CLI::Success();
                        })
      ->group("");
}

Result<> CheckCommands(const CLI::App& app, const std::vector<std::string>& words) {
  const CLI::App* at = &app;
  std::string path = app.get_name();
  for (const std::string& word : words) {
    const std::vector<const CLI::App*> commands = CommandsOf(*at);
    if (commands.empty() || TakesArguments(*at)) return {};
    if (word.starts_with('-')) continue;  // a flag: commands that have commands take no values
    const auto found = std::find_if(commands.begin(), commands.end(),
                                    [&word](const CLI::App* command) { return command->get_name() == word; });
    if (found == commands.end()) return Failure(UnknownCommand(path, commands, word));
    at = *found;
    path += ' ' + word;
  }
  return {};
}

}  // namespace axlecast
