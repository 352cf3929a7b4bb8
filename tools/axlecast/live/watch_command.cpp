#include "tools/axlecast/live/subcommands.h"

#include <poll.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <list>
#include <memory>
#include <optional>

#include "core/base/result.h"
#include "core/base/spelling.h"
#include "platform/net/lcm_port.h"
#include "platform/os/process.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/live/message_watch.h"

namespace axlecast {
namespace {

constexpr int kQueue = 100'000;  // messages; a slow reader of the output must not cause losses

struct WatchOptions {
  ConfigOption config;
  std::string url;
  std::string channel;
  std::int64_t count = 0;
  double seconds = 0;
  bool json = false;
  bool commands = false;
};

class Watch {
 public:
  Watch(const WatchOptions& options, std::regex channel)
      : options_(options), messages_(std::move(channel), options.json) {
    if (!options.json && options.count == 0 && Screen::Usable()) screen_.emplace();
  }

  // Starts to receive messages from `url`.
  Result<> Listen(const std::string& url, const std::string& prefix) {
    LcmPort& port = ports_.emplace_back(url, prefix);
    if (!port.problem().empty()) return Failure(port.problem());
    const auto handler = [this](const std::string& channel, Bytes message) { OnMessage(channel, message); };
    if (!port.Subscribe(".*", handler, kQueue)) return Failure("cannot subscribe on " + url);
    return {};
  }

  int Run() {
    const StopSignal stop;
    const MonoNs end =
        options_.seconds > 0 ? clock_.Now() + static_cast<MonoNs>(std::llround(options_.seconds * 1e9)) : kNever;
    std::vector<pollfd> sources = {{stop.FileDescriptor(), POLLIN, 0}};
    for (const LcmPort& port : ports_) sources.push_back({port.FileDescriptor(), POLLIN, 0});
    while (!done_ && !stop.Requested() && clock_.Now() < end) {
      const MonoNs left = std::min(end - clock_.Now(), kRedrawMs * kMillisecond);
      poll(sources.data(), sources.size(), static_cast<int>(std::max<MonoNs>(left / kMillisecond, 1)));
      for (LcmPort& port : ports_) {
        if (!done_ && !port.Handle(0)) return StopWith("the LCM port failed");
      }
      Report();
      Draw();
    }
    return End();
  }

 private:
  void OnMessage(const std::string& channel, Bytes message) {
    if (done_) return;
    const std::optional<std::string> line = messages_.On(channel, message);
    if (!line) return;
    reader_gone_ = !screen_ && !WriteOut(*line);
    done_ = reader_gone_ || (options_.count > 0 && messages_.shown() >= options_.count);
  }

  void Draw() {
    if (!screen_ || clock_.Now() < next_draw_) return;
    screen_->Draw(messages_.Table(clock_.Now()));
    next_draw_ = clock_.Now() + kRedrawMs * kMillisecond;
  }

  ReceptionCounts Received() const {
    ReceptionCounts counts;
    for (const LcmPort& port : ports_) counts += port.received();
    return counts;
  }

  // Reports losses immediately, except with a table: its losses are reported at the end.
  void Report() {
    if (screen_) return;
    const std::string lost = reception_.NextLine(Received(), clock_.Now(), ports_.front().warning());
    if (!lost.empty()) std::cerr << lost << '\n';
  }

  int StopWith(const std::string& error) {
    screen_.reset();
    return Fail(error, kExitBad);
  }

  int End() {
    screen_.reset();
    for (const std::string& line : messages_.Losses()) std::cerr << line << '\n';
    const std::string lost = ReceptionText(Received(), ports_.front().warning());
    if (!lost.empty()) std::cerr << lost << '\n';
    if (reader_gone_ || (messages_.shown() > 0 && messages_.shown() >= options_.count)) return kExitDone;
    std::cerr << Shortage() << '\n';
    return kExitNoAnswer;
  }

  [[nodiscard]] std::string Shortage() const {
    if (messages_.shown() > 0) return "fewer messages came than asked for";
    const std::string others = messages_.OtherChannels();
    if (others.empty()) return "no message came: is the machine up, on this URL?";
    return "--channel " + Quoted(options_.channel) + " is found in the name of no channel; messages came on " +
           others;
  }

  const WatchOptions& options_;
  SystemClock clock_;
  MessageWatch messages_;
  ReceptionReport reception_;
  std::list<LcmPort> ports_;
  std::optional<Screen> screen_;
  MonoNs next_draw_ = 0;
  bool done_ = false;
  bool reader_gone_ = false;
};

int RunWatch(const WatchOptions& options) {
  std::regex channel;
  try {
    channel = std::regex(options.channel, std::regex::ECMAScript | std::regex::optimize);
  } catch (const std::regex_error& error) {
    std::cerr << "--channel '" << options.channel << "' is no regular expression: " << error.what() << '\n';
    return kExitUsage;
  }
  LcmConfig lcm;
  if (options.config.Given() || (options.url.empty() && !options.config.File().empty())) {
    const auto machine = options.config.Load();
    if (!machine) return options.config.Fail(machine.error());
    lcm = machine->lcm;
  }
  if (!options.url.empty()) lcm.url = options.url;

  Watch watch(options, std::move(channel));
  Result<> listening = watch.Listen(lcm.url, lcm.prefix);
  if (listening && options.commands) listening = watch.Listen(lcm.command_url, lcm.prefix);
  return listening ? watch.Run() : Fail(listening.error().text, kExitBad);
}

}  // namespace

void AddWatchCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<WatchOptions>();
  CLI::App* command = app.add_subcommand("watch", "Show the machine's messages as they arrive");
  options->config.AddTo(*command, ConfigOption::Form::kPositional);
  command->add_option("--url", options->url, "LCM URL, instead of that of the machine's file")->type_name("URL");
  command->add_option("--channel", options->channel, "Show only channels that match REGEX")->type_name("REGEX");
  command->add_option("--count", options->count, "End after N messages")
      ->check(CLI::Range(std::int64_t{1}, std::int64_t{1} << 60))
      ->type_name("N");
  command->add_option("--seconds", options->seconds, "End after S seconds")
      ->check(CLI::Range(0.001, 1e9))
      ->type_name("S");
  command->add_flag("--json", options->json,
                    "Print one JSON object per line: channel, type and the message's fields");
  command->add_flag("--commands", options->commands, "Also show the command port");
  command->footer(
      "examples:\n"
      "  axlecast watch                                             all channels, live\n"
      "  axlecast watch --json --channel '^POSITION/axis1$' --count 100\n"
      "  axlecast watch --url 'udpm://239.255.76.67:7667?ttl=0' --seconds 5\n"
      "exit code 6 if no message arrived, or fewer than --count");
  command->callback([options, &exit_code] { exit_code = RunWatch(*options); });
}

}  // namespace axlecast
