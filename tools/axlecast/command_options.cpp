#include "tools/axlecast/command_options.h"

#include <CLI/CLI.hpp>

namespace axlecast {

void AddCommandOptions(CLI::App& command, ConfigOption& config, CommandWish& wish, bool asks) {
  config.AddTo(command, ConfigOption::Form::kOptionOnly);
  if (asks) command.add_flag("--yes", wish.yes, "Do not ask");
  command.add_flag("--json", wish.json, "The outcome as one JSON object");
  command.add_option("--valid-ms", wish.valid_ms, "It may begin within this time, else it expires; ms")
      ->check(CLI::Range(1, 3'600'000))
      ->type_name("MS")
      ->capture_default_str();
  command.add_option("--epoch", wish.epoch, "Only if the device's datum_epoch is this one")
      ->check(CLI::Range(0, INT32_MAX))
      ->type_name("N");
  command.add_option("--reason", wish.reason, "Why, for the journal; at most 160 bytes")
      ->check(CLI::Validator([](const std::string& text) { return text.size() <= 160 ? "" : "above 160 bytes"; },
                             "TEXT"));
}

}  // namespace axlecast
