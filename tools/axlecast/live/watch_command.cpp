#include "tools/axlecast/live/watch_command.h"
#include "tools/axlecast/common/subcommands.h"

#include <poll.h>
#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <axlecast/alarm_t.hpp>
#include <axlecast/bus_health_t.hpp>
#include <axlecast/device_info_t.hpp>
#include <axlecast/motor_health_t.hpp>
#include <axlecast/motor_limits_t.hpp>
#include <axlecast/position_t.hpp>
#include <axlecast/trip_log_t.hpp>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <list>
#include <memory>
#include <numbers>
#include <string_view>

#include "core/base/result.h"
#include "core/base/spelling.h"
#include "core/base/text.h"
#include "core/messages/enum_names.h"
#include "core/messages/json/field.h"
#include "core/messages/json/message_json.h"
#include "core/messages/message.h"
#include "platform/net/lcm_port.h"
#include "platform/os/process.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/live/format_device.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kOthersKept = 100;
constexpr std::size_t kOthersNamed = 8;
constexpr std::size_t kRowWidth = 200;  // a wide terminal shows more

bool Matches(const std::regex& pattern, const std::string& channel) {
  try {
    return std::regex_search(channel, pattern);
  } catch (const std::regex_error&) {
    return false;  // too complex for this name
  }
}

// "1700000000.000001", as candump and tcpdump write time.
std::string Time(const Json& message) {
  const auto unix_us = message.at("utime").get<std::int64_t>();
  std::array<char, 48> text{};
  static_cast<void>(std::snprintf(text.data(), text.size(), "%lld.%06lld",
                                  static_cast<long long>(unix_us / 1'000'000),
                                  static_cast<long long>(unix_us % 1'000'000)));
  return text.data();
}

std::string Line(const std::string& channel, const std::string& type, const Json& message) {
  Json line;
  line["channel"] = channel;
  line["type"] = type;
  line.update(message);
  return JsonLine(line) + '\n';
}

double Number(float value) { return static_cast<double>(value); }

// Each text describes a message by its essential fields.

std::string DescriptionOf(const position_t& m) {
  return Decimal(m.value, 6) + ' ' + std::string(UnitName(m.unit)) + ", turns " +
         Decimal(static_cast<double>(m.counts) / static_cast<double>(m.counts_per_turn), 6) + ", rpm " +
         Decimal(m.speed_rad_s * 60 / (2 * std::numbers::pi), 1) + ", " + FlagNames(m.flags);
}

std::string DescriptionOf(const alarm_t& m) {
  std::string text;
  for (const alarm_entry_t& entry : m.entries) {
    text += (text.empty() ? "" : ", ") + entry.name + " (" + std::string(SeverityName(entry.severity)) + ", " +
            std::string(AlarmStateName(entry.state)) + ")";
  }
  return text.empty() ? "no alarm" : text;
}

std::string GoodAndErrors(std::int64_t good, const std::string& errors) {
  return ", good " + std::to_string(good) + (errors.empty() ? "" : ", errors: " + errors);
}

std::string DescriptionOf(const device_info_t& m) {
  return std::string(DeviceStateName(m.state)) + (m.reason.empty() ? "" : " (" + m.reason + ")") + ", " + m.family +
         ' ' + m.model + GoodAndErrors(m.good, ErrorCounts(m.errors));
}

std::string DescriptionOf(const bus_health_t& m) {
  return std::string(BusStateName(m.state)) + ", " + Decimal(Number(m.rate_hz), 1) + " of " +
         Decimal(Number(m.wire_limit_hz), 0) + " exchanges/s" + GoodAndErrors(m.good, ErrorCounts(m.errors));
}

std::string DescriptionOf(const motor_health_t& m) {
  return MotorQuantities(m) + ", " + MotorStatusText(m) + ", trips " + std::to_string(m.trip_count);
}

std::string DescriptionOf(const trip_log_t& m) {
  const std::string cause = MotorStatusNames(m.factor_bits);
  return "trip " + std::to_string(m.trip_count) + ", " + (cause.empty() ? "cause unknown" : cause) + ", log " +
         std::to_string(m.log_index) + ", a sample each " + Decimal(m.interval_us / 1e6, 1) + " s";
}

// Limits that are 0 or unknown are omitted.
std::string DescriptionOf(const motor_limits_t& m) {
  std::string text;
  const auto add = [&text](const char* what, float limit, const char* unit, int decimals) {
    if (!(limit > 0)) return;
    text += (text.empty() ? "trips at " : ", ") + std::string(what) + Decimal(Number(limit), decimals) + unit;
  };
  add("power A above ", m.power_upper_w[0], " W", 1);
  add("power B above ", m.power_upper_w[1], " W", 1);
  add("power A below ", m.power_lower_w[0], " W", 1);
  add("power B below ", m.power_lower_w[1], " W", 1);
  add("", m.overheat_c, " degC", 1);
  add("", m.shock_mps2, " m/s2", 2);
  return text.empty() ? "no limit is known" : text;
}

// Any other message: its fields after the head, as JSON.
std::string FieldsText(const Json& message) {
  constexpr std::array<std::string_view, 7> kHead = {"utime",      "mono_ns",  "boot_id", "seq",
                                                     "machine_id", "clock_id", "spare"};
  Json rest = Json::object();
  for (const auto& [name, value] : message.items()) {
    if (std::ranges::find(kHead, name) == kHead.end()) rest[name] = value;
  }
  return JsonLine(rest);
}

template <typename Message>
std::string Decoded(Bytes bytes) {
  const auto message = DecodeMessage<Message>(bytes);
  return message ? DescriptionOf(*message) : "";
}

// Formats the essential fields of a message in printable ASCII. `json`: from DecodeToJson.
std::string Describe(const std::string& type, Bytes bytes, const Json& json) {
  static const std::map<std::string_view, std::string (*)(Bytes)> kTypes = {
      {"position_t", &Decoded<position_t>},         {"alarm_t", &Decoded<alarm_t>},
      {"device_info_t", &Decoded<device_info_t>},   {"bus_health_t", &Decoded<bus_health_t>},
      {"motor_health_t", &Decoded<motor_health_t>}, {"trip_log_t", &Decoded<trip_log_t>},
      {"motor_limits_t", &Decoded<motor_limits_t>}};
  const auto found = kTypes.find(type);
  return Printable(found == kTypes.end() ? FieldsText(json) : found->second(bytes));
}

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
  Result<> Listen(const std::string& url, const std::string& prefix, const std::string& machine) {
    LcmPort& port = ports_.emplace_back(url, prefix, machine);
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
    const std::optional<std::string> line = messages_.On(channel, message, clock_.Now());
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
    if (others.empty()) return "no message came: is the machine up, on this URL?" + NetworkNote(Received());
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
  std::string name;  // of the machine; with --url, messages of all machines are shown
  if (options.config.Given() || (options.url.empty() && !options.config.File().empty())) {
    const auto machine = options.config.Load();
    if (!machine) return options.config.Fail(machine.error());
    lcm = machine->lcm;
    if (options.url.empty()) name = machine->machine;
  }
  if (!options.url.empty()) lcm.url = options.url;

  Watch watch(options, std::move(channel));
  Result<> listening = watch.Listen(lcm.url, lcm.prefix, name);
  if (listening && options.commands) listening = watch.Listen(lcm.command_url, lcm.prefix, name);
  return listening ? watch.Run() : Fail(listening.error().text, kExitBad);
}

}  // namespace

std::optional<std::string> MessageWatch::On(const std::string& channel, Bytes message, MonoNs now) {
  if (json_) base_.Take(message, now);
  if (!Matches(channel_, channel)) {
    if (shown_ == 0 && others_.size() < kOthersKept) others_.insert(channel);
    return std::nullopt;
  }
  std::string type;
  std::optional<Json> json = DecodeToJson(message, &type);
  if (!json || !json->contains("seq")) {
    ++unknown_;
    return std::nullopt;
  }
  ++shown_;
  const std::string newest = json_ ? "" : Describe(type, message, *json);
  Count(channel, static_cast<std::int64_t>(std::stoull(json->at("boot_id").get<std::string>(), nullptr, 16)),
        json->at("seq").get<std::int64_t>(), newest);
  if (json_) {
    base_.Add(*json, now);
    return Line(channel, type, *json);
  }
  return Time(*json) + ' ' + Printable(channel) + "  " + newest + '\n';
}

void MessageWatch::Count(const std::string& channel, std::int64_t boot_id, std::int64_t seq,
                         const std::string& newest) {
  auto seen = channels_.find(channel);
  if (seen == channels_.end()) {
    if (channels_.size() >= kMaxChannels) {
      ++uncounted_;
      return;
    }
    seen = channels_.try_emplace(channel).first;
  }
  seen->second.sequence.On(boot_id, seq);
  seen->second.newest = newest;
}

std::vector<std::string> MessageWatch::Table(MonoNs now) {
  const MonoNs window = now - window_;
  std::vector<std::string> lines = {"CHANNEL                           /s  NEWEST"};
  for (auto& [channel, seen] : channels_) {
    if (window >= kSecond) {
      const std::int64_t received = seen.sequence.received();
      if (window_ != 0)
        seen.hz = static_cast<double>(received - seen.at_window) * 1e9 / static_cast<double>(window);
      seen.at_window = received;
    }
    lines.push_back(
        Clip(Left(Printable(channel), 28) + ' ' + Right(Decimal(seen.hz, 1), 8) + "  " + seen.newest, kRowWidth));
  }
  if (window >= kSecond) window_ = now;
  return lines;
}

std::string MessageWatch::OtherChannels() const {
  std::string text;
  std::size_t named = 0;
  for (const std::string& channel : others_) {
    if (named == kOthersNamed) return text + " and more";
    text += (named++ == 0 ? "" : ", ") + Printable(channel);
  }
  return text;
}

std::vector<std::string> MessageWatch::Losses() const {
  std::vector<std::string> lines;
  for (const auto& [channel, seen] : channels_) {
    if (seen.sequence.lost() == 0) continue;
    lines.push_back(Printable(channel) + ": " + std::to_string(seen.sequence.lost()) + " of " +
                    std::to_string(seen.sequence.lost() + seen.sequence.received()) +
                    " messages lost on the way here");
  }
  if (uncounted_ > 0) {
    lines.push_back(std::to_string(uncounted_) + " messages were of channels beyond the first " +
                    std::to_string(kMaxChannels) + ": their losses were not counted");
  }
  if (unknown_ > 0) lines.push_back(std::to_string(unknown_) + " messages that are not axlecast's were not shown");
  return lines;
}

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
