#include "tools/axlecast/logs/subcommands.h"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/messages/json/field.h"
#include "platform/os/mapped_file.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/logs/log_input.h"
#include "tools/axlecast/logs/replay_run.h"

namespace axlecast {
namespace {

struct ReplayOptions {
  std::vector<std::string> logs;
  ConfigOption config;
  std::string url;
  std::string command_url;
  LogTimeOptions time;
  ReplayWish wish;
  std::string channel;
  bool invert = false;
  std::vector<std::string> renames;
  std::string prefix;
  Replay::Options replay;
  bool allow_live = false;
  bool json = false;
};

int Refuse(const std::string& problem, int exit_code) {
  std::cerr << problem << '\n';
  return exit_code;
}

std::string UnderstandChannels(const ReplayOptions& options, ReplayChannels& channels) {
  std::string problem;
  if (!options.channel.empty()) problem = channels.Select(options.channel, options.invert);
  if (!problem.empty()) return "--channel: " + problem;
  for (const std::string& rule : options.renames) {
    problem = channels.Rename(rule);
    if (!problem.empty()) return "--rename: " + problem;
  }
  channels.Prefix(options.prefix);
  return "";
}

// --url, else the file's that was named, else $LCM_DEFAULT_URL, else that of the machine's file at a usual place, else
// the usual one. Nothing when the machine's file cannot be used.
std::optional<LcmConfig> FindUrls(const ReplayOptions& options, int& exit_code) {
  LcmConfig lcm;
  const char* environment = std::getenv("LCM_DEFAULT_URL");
  const bool has_environment = environment != nullptr && *environment != '\0';
  const bool url_known = !options.url.empty() || has_environment;
  if (options.config.Given() || (!url_known && !options.config.File().empty())) {
    const auto machine = options.config.Load(exit_code);
    if (!machine) return std::nullopt;
    lcm = machine->lcm;
  } else if (has_environment) {
    lcm.url = environment;
  }
  if (!options.url.empty()) lcm.url = options.url;
  if (!options.command_url.empty()) lcm.command_url = options.command_url;
  return lcm;
}

// Whether nothing speaks against playing on this URL. Says why.
bool IsFree(const std::string& url) {
  std::string problem;
  const std::optional<std::string> heard = HearLiveMachine(url, problem);
  if (!heard) {
    std::cerr << problem << '\n';
  } else if (!heard->empty()) {
    std::cerr << "refused: a machine is live on " << url << ": " << *heard
              << ".\nIts consumers could not tell recorded messages from its own. Play on another --url, end the "
                 "machine, or say --allow-live --yes-allow-live.\n";
  }
  return heard && heard->empty();
}

bool AreFree(const ReplayOptions& options, const LcmConfig& lcm) {
  if (options.allow_live) return true;
  if (options.replay.allow_commands && !IsFree(lcm.command_url)) return false;
  return IsFree(lcm.url);
}

class Logs {
 public:
  // Empty when all can be read, else why not.
  std::string Open(const std::vector<std::string>& paths) {
    for (const std::string& path : paths) {
      const MappedFile& file = files_.emplace_back(path);
      if (!file.problem().empty()) return file.problem();
      bytes_.push_back(file.bytes());
    }
    return "";
  }
  [[nodiscard]] const std::vector<MappedFile>& files() const { return files_; }
  [[nodiscard]] const std::vector<Bytes>& bytes() const { return bytes_; }

 private:
  std::vector<MappedFile> files_;
  std::vector<Bytes> bytes_;
};

// Why not a single message was played.
std::string NothingPlayed(const Replay& replay) {
  if (replay.range().empty) {
    return replay.damage().regions > 0
               ? "nothing was played: no event of LCM's event log is in it"
               : "nothing was played: no event is in the log, or in the part that was asked for";
  }
  if (replay.counts().held_back > 0) return "nothing was played but what was held back";
  return "nothing was played: no event of the channels that were asked for is in the log";
}

int Finish(const Replay& replay, const ReplayOutcome& outcome, bool json) {
  if (json) std::cout << JsonLine(ReplayJson(replay, outcome)) << std::endl;
  std::cerr << ReplaySummary(replay, outcome);
  if (replay.counts().played == 0 && !outcome.stopped) return Refuse(NothingPlayed(replay), kExitBad);
  const bool whole = replay.damage().regions == 0 && outcome.unsent == 0 && outcome.loss.empty();
  return whole ? kExitDone : kExitLosses;
}

int RunReplay(ReplayOptions options) {
  ReplayChannels channels;
  std::string problem = UnderstandChannels(options, channels);
  if (!problem.empty()) return Refuse(problem, kExitUsage);
  int exit_code = kExitDone;
  const std::optional<LcmConfig> lcm = FindUrls(options, exit_code);
  if (!lcm) return exit_code;
  Logs logs;
  if (problem = logs.Open(options.logs); !problem.empty()) return Refuse(problem, kExitBad);
  if (problem = options.time.Understand(logs.bytes()); !problem.empty()) return Refuse(problem, kExitUsage);
  options.wish.from = options.time.from();
  options.wish.until = options.time.until();
  if (!AreFree(options, *lcm)) return kExitBad;

  LcmPort data(lcm->url, "");
  LcmPort commands(options.replay.allow_commands ? lcm->command_url : lcm->url, "");
  for (const LcmPort* port : {&data, &commands}) {
    if (!port->problem().empty()) return Refuse(port->problem(), kExitBad);
  }
  const bool shows = isatty(STDERR_FILENO) == 1;
  if (shows && TerminalKeys::Usable()) std::cerr << kReplayKeysHelp << '\n';
  const ReplayRange range = FindRange(logs.bytes(), options.wish);
  Replay replay(logs.bytes(), range, channels, options.replay, SystemClock().Now());
  const ReplayOutcome outcome = ReplayRun(replay, logs.files(), data, commands, shows).Run();
  return Finish(replay, outcome, options.json);
}

void AddRangeOptions(CLI::App& command, ReplayOptions& options) {
  const auto number = CLI::Range(std::int64_t{0}, std::int64_t{1} << 60);
  options.time.AddTo(command);
  command.add_option("--start-event", options.wish.start_event, "From this event on, counted from 0")
      ->check(number)
      ->type_name("N");
  command.add_option("--end-event", options.wish.end_event, "Up to this event, which is not played any more")
      ->check(number)
      ->type_name("N");
}

void AddChannelOptions(CLI::App& command, ReplayOptions& options) {
  CLI::Option* channel =
      command
          .add_option("--channel", options.channel, "Only channels in whose name this is found; ^ and $ anchor it")
          ->type_name("REGEX");
  command.add_flag("--invert", options.invert, "All channels but those")->needs(channel);
  command
      .add_option("--rename", options.renames,
                  "Where the expression OLD is found in a channel's name, puts NEW ($1: its first group); may be "
                  "repeated")
      ->allow_extra_args(false)
      ->type_name("OLD=NEW");
  command.add_option("--prefix", options.prefix, "Before every channel's name, renamed or not")->type_name("TEXT");
}

// What only two flags together allow.
void AddTwice(CLI::App& command, const std::string& name, bool& allowed, const std::string& what) {
  const std::string twice = what + "; needs --yes-allow-" + name + " too";
  CLI::Option* allow = command.add_flag("--allow-" + name, twice);
  CLI::Option* yes = command.add_flag("--yes-allow-" + name, allowed, "Confirms --allow-" + name);
  allow->needs(yes);
  yes->needs(allow);
}

}  // namespace

void AddReplayCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ReplayOptions>();
  CLI::App* command = app.add_subcommand("replay", "Plays recorded event logs on LCM, as they were heard");
  command->add_option("LOG", options->logs, "Event logs, of axlecast or lcm-logger; several are merged by time")
      ->required();
  command->add_option("--speed", options->replay.speed, "2 plays twice as fast; 0 as fast as possible")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str()
      ->type_name("X");
  AddRangeOptions(*command, *options);
  command->add_flag("--loop", options->replay.loop, "Begins anew at the end, until it is stopped");
  command->add_flag("--paused", options->replay.paused, "Waits for the space bar before the first message");
  AddChannelOptions(*command, *options);
  options->config.AddTo(*command, ConfigOption::Form::kOptionOnly);
  command->add_option("--url", options->url, "LCM URL to play on; else the machine's, or $LCM_DEFAULT_URL")
      ->type_name("URL");
  command->add_option("--command-url", options->command_url, "Where commands are played that are allowed")
      ->type_name("URL");
  AddTwice(*command, "commands", options->replay.allow_commands, "Plays command and permit channels too");
  AddTwice(*command, "live", options->allow_live, "Plays where a live machine is heard");
  command->add_flag("--json", options->json, "What was played, as one JSON object");
  command->footer(
      std::string("examples:\n"
                  "  axlecast replay monday.log\n"
                  "  axlecast replay a.log b.log --speed 0 --channel '^POSITION/'\n"
                  "  axlecast replay monday.log --from 2026-11-21T07:00:05 --until 2026-11-21T07:01 --loop\n"
                  "  axlecast replay monday.log --from=-10 --prefix OLD/ --rename 'axis([12])=joint$1'\n"
                  "keys on a terminal: ") +
      kReplayKeysHelp +
      "\n"
      "exit code: 0 all was played, or it was stopped; 3 played, but damage was skipped, the log was "
      "cut\n"
      "meanwhile or a message could not be sent; 1 nothing was played; 2 usage. docs/replay.md");
  command->callback([options, &exit_code] { exit_code = RunReplay(*options); });
}

}  // namespace axlecast
