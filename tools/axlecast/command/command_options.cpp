#include "tools/axlecast/command/command_options.h"

#include <CLI/CLI.hpp>

#include "core/base/spelling.h"
#include "core/command/command_id.h"

namespace axlecast {

void AddCommandOptions(CLI::App& command, ConfigOption& config, CommandOptions& wish, bool asks) {
  config.AddTo(command, ConfigOption::Form::kOptionOnly);
  AddKeyOption(command, wish.key);
  if (asks) command.add_flag("--yes", wish.yes, "Do not ask");
  command.add_flag("--json", wish.json, "The outcome as one JSON object");
  command.add_option("--valid-ms", wish.valid_ms, "It may begin within this time, else it expires; ms")
      ->check(CLI::Range(1, 3'600'000))
      ->type_name("MS")
      ->capture_default_str();
  command.add_option("--epoch", wish.epoch, "Only if the device's datum_epoch is this one")
      ->check(CLI::Range(0, INT32_MAX))
      ->type_name("N");
  AddReasonOption(command, wish.reason);
}

void AddReasonOption(CLI::App& command, std::string& reason) {
  command.add_option("--reason", reason, "Why, for the journal; at most 160 bytes")
      ->check(CLI::Validator([](const std::string& text) { return text.size() <= 160 ? "" : "above 160 bytes"; },
                             "TEXT"));
}

void AddKeyOption(CLI::App& command, std::string& key) {
  command
      .add_option(
          "--key", key,
          "File of the secret key that signs; else $AXLECAST_KEY, else the first of the machine's keys that can "
          "be read here")
      ->type_name("FILE");
}

CLI::Validator PlainNumber() {
  return CLI::Validator(
      [](const std::string& text) -> std::string {
        if (CLI::Number(text).empty()) return "";
        const std::size_t digits = text.find_first_not_of("+-.0123456789");
        const std::string number = text.substr(0, digits);
        if (digits == 0 || !CLI::Number(number).empty()) return Quoted(text) + " is no number, e.g. 123.456";
        return Quoted(text) +
               " is no number: leave the unit out (it is the device's, see `axlecast info DEVICE`), " +
               "and write " + number;
      },
      "NUMBER");
}

void AddTwoStepOptions(CLI::App& command, CommandOptions& wish) {
  CLI::Option* prepare =
      command.add_flag("--prepare", wish.prepare, "Only say what would happen, and give a token for --commit");
  command
      .add_option("--commit", wish.commit,
                  "Do what --prepare with the same words gave this token for; does not ask")
      ->check(CLI::Validator(
          [](const std::string& text) { return ParseId(text) ? "" : "a token is 32 hex digits"; }, "TOKEN"))
      ->excludes(prepare);
}

}  // namespace axlecast
