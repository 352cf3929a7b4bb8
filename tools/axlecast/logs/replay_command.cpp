#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/exchange_stats.h"
#include "core/messages/json/field.h"
#include "platform/net/lcm_port.h"
#include "platform/os/process.h"
#include "platform/os/system_clock.h"
#include "platform/os/terminal.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/subcommands.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/logs/log_input.h"
#include "tools/axlecast/logs/replay_console.h"

namespace axlecast {
namespace {

struct ReplayOptions {
  std::vector<std::string> logs;
  ConfigOption config;
  std::string url;
  std::string command_url;
  LogTimeOptions time;
  ReplayRangeOptions range;
  std::string channel;
  bool invert = false;
  std::vector<std::string> renames;
  std::string prefix;
  Replay::Options replay;
  bool allow_live = false;
  bool json = false;
};

Result<ReplayChannels> ChannelsOf(const ReplayOptions& options) {
  ReplayChannels channels;
  if (!options.channel.empty()) {
    const Result<> selected = channels.Select(options.channel, options.invert);
    if (!selected) return Failure("--channel: " + selected.error().text);
  }
  for (const std::string& rule : options.renames) {
    if (const Result<> renamed = channels.Rename(rule); !renamed)
      return Failure("--rename: " + renamed.error().text);
  }
  channels.Prefix(options.prefix);
  return channels;
}

// Returns the URLs: --url, else those of the file given by --config, else $LCM_DEFAULT_URL, else those of the machine's file at a
// default path, else the default. Returns nothing if the machine's file is invalid.
std::optional<LcmConfig> FindUrls(const ReplayOptions& options, int& exit_code) {
  LcmConfig lcm;
  const char* environment = std::getenv("LCM_DEFAULT_URL");
  const bool has_environment = environment != nullptr && *environment != '\0';
  const bool url_known = !options.url.empty() || has_environment;
  if (options.config.Given() || (!url_known && !options.config.File().empty())) {
    const auto machine = options.config.Load();
    if (!machine) {
      exit_code = options.config.Fail(machine.error());
      return std::nullopt;
    }
    lcm = machine->lcm;
  } else if (has_environment) {
    lcm.url = environment;
  }
  if (!options.url.empty()) lcm.url = options.url;
  if (!options.command_url.empty()) lcm.command_url = options.command_url;
  return lcm;
}

// Listens for 1.2 s, because every driver publishes its state once a second. Returns the names of channels on which messages of
// a running machine were received; an empty text if there was none. Messages of recorders do not count.
Result<std::string> DetectLiveTraffic(const std::string& url) {
  constexpr MonoNs kListen = 1'200 * kMillisecond;
  constexpr int kSliceMs = 50;
  LcmPort port(url, "");
  LiveChannels channels;
  const auto handler = [&channels](const std::string& channel, Bytes message) { channels.On(channel, message); };
  if (!port.problem().empty()) return Failure(port.problem());
  if (!port.Subscribe(".*", handler)) return Failure("cannot subscribe on " + url);
  const SystemClock clock;
  for (const MonoNs end = clock.Now() + kListen; clock.Now() < end;) {
    if (!port.Handle(kSliceMs)) return Failure("the LCM port failed: " + url);
  }
  return channels.Text();
}

// Returns an error if a machine is live on this URL.
Result<> CheckFree(const std::string& url) {
  const Result<std::string> channels = DetectLiveTraffic(url);
  if (!channels) return Failure(channels.error());
  if (channels->empty()) return {};
  return Failure(
      "refused: a machine is live on " + url + ": " + *channels +
      ".\nIts consumers cannot distinguish recorded messages from its own. Replay on another --url, stop the "
      "machine, or add --allow-live --yes-allow-live.");
}

Result<> CheckFree(const ReplayOptions& options, const LcmConfig& lcm) {
  if (options.allow_live) return {};
  const Result<> commands = options.replay.allow_commands ? CheckFree(lcm.command_url) : Result<>();
  return commands ? CheckFree(lcm.url) : commands;
}

// On many machines, a timer is late by some tens of us: the remaining time is spun.
constexpr MonoNs kSpin = 80 * kMicrosecond;
constexpr int kMaxAtOnce = 256;  // messages between two checks of keys and signals
constexpr double kFastest = 1'024;
constexpr double kSlowest = 1.0 / 64;
constexpr const char* kClearLine = "\r\x1b[K";

// Publishes a replay on LCM until its end, or until the operator or a signal stops it. Keys of the terminal control it.
class ReplayRun {
 public:
  // `logs`: the replayed files. `commands`: port for command and permit channels. `shows`: show the progress on standard error.
  ReplayRun(Replay& replay, const LogFiles& logs, LcmPort& data, LcmPort& commands, bool shows)
      : replay_(replay), logs_(logs), data_(data), commands_(commands), shows_(shows) {
    // Sets no priority, only exact timers. If the kernel cannot do that, messages are sent a little later.
    static_cast<void>(ApplyRealtime(0, -1, false));
  }

  [[nodiscard]] ReplayOutcome Run() {
    const MonoNs begin = clock_.Now();
    std::string loss;
    while (!replay_.AtEnd() && !quit_ && !stop_.Requested() && loss.empty()) {
      Show();
      Wait();
      for (const ReplayKey key : keys_.On(terminal_.Read())) OnKey(key);
      loss = logs_.Loss();  // the content of further messages could be zeros
      if (!quit_ && !stop_.Requested() && loss.empty()) PlayDue();
    }
    if (shows_) SteerTerminal(kClearLine);
    const auto us = [](MonoNs duration) { return static_cast<double>(duration) / kMicrosecond; };
    ReplayOutcome outcome{.stopped = !replay_.AtEnd(),
                          .loss = logs_.Loss(),
                          .unsent = data_.unsent() + commands_.unsent(),
                          .seconds = static_cast<double>(clock_.Now() - begin) / kSecond,
                          .late_max_us = us(late_.max())};
    if (late_.count() > 0) {
      outcome.late_p50_us = us(late_.Percentile(0.5));
      outcome.late_p99_us = us(late_.Percentile(0.99));
    }
    return outcome;
  }

 private:
  // Waits until a message is due, a key is pressed or a signal arrives.
  void Wait() {
    const MonoNs due = replay_.Due();
    const MonoNs wake = due == kNever ? kNever : due - kSpin;
    std::array<pollfd, 2> sources = {pollfd{stop_.FileDescriptor(), POLLIN, 0},
                                     pollfd{terminal_.FileDescriptor(), POLLIN, 0}};
    const int ready = PollUntil(sources, shows_ ? std::min(wake, next_show_) : wake, clock_);
    if (ready == 0 && due != kNever && due - clock_.Now() <= kSpin) WaitUntil(due, clock_);
  }

  void PlayDue() {
    for (int i = 0; i < kMaxAtOnce; ++i) {
      const MonoNs now = clock_.Now();
      if (replay_.Due() > now) return;
      const std::optional<Replay::Message> message = replay_.Take(now);
      if (!message) continue;
      late_.Add(now - message->due);
      (message->command ? commands_ : data_).Publish(*message->channel, message->data);
    }
  }

  void OnKey(ReplayKey key) {
    const MonoNs now = clock_.Now();
    next_show_ = 0;
    switch (key) {
      case ReplayKey::kPause:
        return replay_.paused() ? replay_.Resume(now) : replay_.Pause(now);
      case ReplayKey::kStep:
        return replay_.Step(now);
      case ReplayKey::kBack1:
        return SeekBy(-1);
      case ReplayKey::kForward1:
        return SeekBy(1);
      case ReplayKey::kBack10:
        return SeekBy(-10);
      case ReplayKey::kForward10:
        return SeekBy(10);
      case ReplayKey::kFaster:
        return replay_.SetSpeed(std::min(replay_.speed() * 2, kFastest), now);
      case ReplayKey::kSlower:
        return replay_.SetSpeed(replay_.speed() == 0 ? 1 : std::max(replay_.speed() / 2, kSlowest), now);
      case ReplayKey::kQuit:
        quit_ = true;
        return;
    }
  }

  void SeekBy(std::int64_t seconds) {
    const MonoNs now = clock_.Now();
    replay_.Seek(replay_.Utime(now) + seconds * 1'000'000, now);
  }

  void Show() {
    const MonoNs now = clock_.Now();
    if (!shows_ || now < next_show_) return;
    SteerTerminal(kClearLine);
    std::cerr << ReplayProgress(replay_, now) << std::flush;
    next_show_ = now + kRedrawMs * kMillisecond;
  }

  Replay& replay_;
  const LogFiles& logs_;
  LcmPort& data_;
  LcmPort& commands_;
  bool shows_;
  SystemClock clock_;
  StopSignal stop_;
  TerminalKeys terminal_;
  ReplayKeys keys_;
  ExchangeStats late_;
  MonoNs next_show_ = 0;
  bool quit_ = false;
};

// Returns the reason why no message was played.
std::string NothingPlayed(const Replay& replay) {
  if (replay.range().empty) {
    return replay.damage().regions > 0 ? "nothing was played: the log contains no event of LCM's format"
                                       : "nothing was played: the log, or its selected part, contains no event";
  }
  if (replay.counts().held_back > 0) return "nothing was played: all selected messages were held back";
  return "nothing was played: the log contains no event of the selected channels";
}

int Finish(const Replay& replay, const ReplayOutcome& outcome, bool json) {
  if (json) std::cout << JsonLine(ReplayJson(replay, outcome)) << std::endl;
  std::cerr << ReplaySummary(replay, outcome);
  if (replay.counts().played == 0 && !outcome.stopped && outcome.loss.empty())
    return Fail(NothingPlayed(replay), kExitBad);
  const bool whole = replay.damage().regions == 0 && outcome.unsent == 0 && outcome.loss.empty();
  return whole ? kExitDone : kExitLosses;
}

int RunReplay(ReplayOptions options) {
  const Result<ReplayChannels> channels = ChannelsOf(options);
  if (!channels) return Fail(channels.error().text, kExitUsage);
  int exit_code = kExitDone;
  const std::optional<LcmConfig> lcm = FindUrls(options, exit_code);
  if (!lcm) return exit_code;
  LogFiles logs;
  if (const Result<> opened = logs.Open(options.logs); !opened) return Fail(opened.error().text, kExitBad);
  std::cerr << logs.Damage();
  if (const Result<> parsed = options.time.Parse(logs.bytes()); !parsed)
    return Fail(parsed.error().text, kExitUsage);
  options.range.from = options.time.from;
  options.range.until = options.time.until;
  if (const Result<> free = CheckFree(options, *lcm); !free) return Fail(free.error().text, kExitBad);

  LcmPort data(lcm->url, "");
  LcmPort commands(options.replay.allow_commands ? lcm->command_url : lcm->url, "");
  for (const LcmPort* port : {&data, &commands}) {
    if (!port->problem().empty()) return Fail(port->problem(), kExitBad);
  }
  if (const std::string network = data.received().network; !network.empty())
    std::cerr << "LCM: " << network << '\n';
  const bool shows = isatty(STDERR_FILENO) == 1;
  if (shows && TerminalKeys::Usable()) std::cerr << kReplayKeysHelp << '\n';
  const ReplayRange range = FindRange(logs.bytes(), options.range);
  Replay replay(logs.bytes(), range, *channels, options.replay, SystemClock().Now());
  const ReplayOutcome outcome = ReplayRun(replay, logs, data, commands, shows).Run();
  const int result = Finish(replay, outcome, options.json);
  return result == kExitDone && !logs.Damage().empty() ? kExitLosses : result;
}

void AddRangeOptions(CLI::App& command, ReplayOptions& options) {
  const auto number = CLI::Range(std::int64_t{0}, std::int64_t{1} << 60);
  options.time.AddTo(command);
  command.add_option("--start-event", options.range.start_event, "Begin with this event, counted from 0")
      ->check(number)
      ->type_name("N");
  command.add_option("--end-event", options.range.end_event, "End before this event")
      ->check(number)
      ->type_name("N");
}

void AddChannelOptions(CLI::App& command, ReplayOptions& options) {
  CLI::Option* channel =
      command.add_option("--channel", options.channel, "Replay only channels that match REGEX; ^ and $ anchor it")
          ->type_name("REGEX");
  command.add_flag("--invert", options.invert, "Replay only channels that do not match")->needs(channel);
  command
      .add_option(
          "--rename", options.renames,
          "Replace matches of the expression OLD in channel names by NEW ($1: first group); may be repeated")
      ->allow_extra_args(false)
      ->type_name("OLD=NEW");
  command.add_option("--prefix", options.prefix, "Add a prefix to the name of every channel")->type_name("TEXT");
}

// Adds an option that is effective only together with a second one.
void AddTwice(CLI::App& command, const std::string& name, bool& allowed, const std::string& what) {
  const std::string twice = what + "; also needs --yes-allow-" + name;
  CLI::Option* allow = command.add_flag("--allow-" + name, twice);
  CLI::Option* yes = command.add_flag("--yes-allow-" + name, allowed, "Confirm --allow-" + name);
  allow->needs(yes);
  yes->needs(allow);
}

}  // namespace

void AddReplayCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ReplayOptions>();
  CLI::App* command =
      app.add_subcommand("replay", "Send the messages of event logs on LCM, at the recorded intervals");
  command->add_option("LOG", options->logs, "Event logs of axlecast or lcm-logger; several logs are merged by time")
      ->required();
  command->add_option("--speed", options->replay.speed, "Speed factor; 2 is twice as fast, 0 as fast as possible")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str()
      ->type_name("X");
  AddRangeOptions(*command, *options);
  command->add_flag("--loop", options->replay.loop, "Begin again at the end, until it is stopped");
  command->add_flag("--paused", options->replay.paused, "Wait for the space bar before the first message");
  AddChannelOptions(*command, *options);
  options->config.AddTo(*command, ConfigOption::Form::kOptionOnly);
  command->add_option("--url", options->url, "Send on this LCM URL (default: the machine's, or $LCM_DEFAULT_URL)")
      ->type_name("URL");
  command->add_option("--command-url", options->command_url, "Send allowed commands on this LCM URL")
      ->type_name("URL");
  AddTwice(*command, "commands", options->replay.allow_commands, "Also replay command and permit channels");
  AddTwice(*command, "live", options->allow_live, "Replay although a live machine is detected");
  command->add_flag("--json", options->json, "Print the result as one JSON object");
  command->footer(
      std::string("examples:\n"
                  "  axlecast replay monday.log\n"
                  "  axlecast replay a.log b.log --speed 0 --channel '^POSITION/'\n"
                  "  axlecast replay monday.log --from 2026-11-21T07:00:05 --until 2026-11-21T07:01 --loop\n"
                  "  axlecast replay monday.log --from=-10 --prefix OLD/ --rename 'axis([12])=joint$1'\n"
                  "keys on a terminal: ") +
      kReplayKeysHelp +
      "\n"
      "exit code: 0 all was played, or it was stopped; 3 damage was skipped, the log was truncated meanwhile or a\n"
      "message could not be sent; 1 nothing was played; 2 usage. docs/replay.md");
  command->callback([options, &exit_code] { exit_code = RunReplay(*options); });
}

}  // namespace axlecast
