#include "tools/axlecast/logs/record_options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <utility>

#include "core/base/expression.h"
#include "core/base/result.h"
#include "tools/axlecast/common/program.h"

namespace axlecast {
namespace {

constexpr std::size_t kLongestName = 24;

MonoNs Nanoseconds(double seconds) { return static_cast<MonoNs>(std::llround(seconds * 1e9)); }

bool IsName(const std::string& name) {
  return !name.empty() && name.size() <= kLongestName &&
         name.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-") ==
             std::string::npos;
}

bool IsFolder(const std::string& path) {
  std::error_code error;
  return path.empty() || path.ends_with('/') || std::filesystem::is_directory(path, error);
}

// "--split-size is at least 1MB".
std::string OptionText(const LogFault& fault) {
  std::string option = fault.key;
  std::replace(option.begin(), option.end(), '_', '-');
  return (option == "channels" ? "--channel" : "--" + option) + ": " + fault.text;
}

// Where nothing can be heard.
std::string UrlProblem(const std::vector<std::string>& urls) {
  for (const std::string& url : urls) {
    if (url.starts_with("file://")) {
      return "--url " + url +
             ": what is in a log is recorded already: `axlecast log filter` and `merge` make another "
             "of it, `axlecast replay` plays it";
    }
    if (url.starts_with("memq://"))
      return "--url " + url + ": stays within one process: nothing can be heard there";
  }
  return "";
}

std::string Contradiction(const RecordOptions& options, const LogConfig& log, bool names_logs) {
  if (options.append && names_logs) return "--append needs the file that it goes on with";
  if (options.append && !log.trigger.empty()) {
    return "--append goes on with one log, but with --trigger each episode is a log of its own: leave out "
           "--append, "
           "and give a folder; `axlecast log merge` makes one log of them";
  }
  if ((log.quota_bytes > 0 || log.keep > 0) && !names_logs) {
    return "--quota and --keep delete only logs that record has named itself: give a folder instead of a file";
  }
  if (!IsName(log.name)) return "--name '" + log.name + "' is no name: 1 to 24 of letters, digits, _ and -";
  if (std::string problem = UrlProblem(options.urls); !problem.empty()) return problem;
  const std::vector<LogFault> faults = FaultsOf(log);
  return faults.empty() ? "" : OptionText(faults.front());
}

// The log of the command line.
LogConfig LogOf(const RecordOptions& options, const std::optional<MachineConfig>& machine) {
  LogConfig log = options.log;
  if (log.name.empty()) log.name = machine ? machine->machine : "axlecast";
  log.split_time = Nanoseconds(options.split_s);
  log.keep = Nanoseconds(options.keep_s);
  log.pre_trigger = Nanoseconds(options.before_s);
  log.post_trigger = Nanoseconds(options.after_s);
  log.sync = options.sync_ms * kMillisecond;
  return log;
}

// `log` is without faults.
RecordingSettings SettingsOf(const LogConfig& log, const LogIdentity& machine) {
  RecordingSettings settings;
  LogIdentity& identity = settings.recorder.identity;
  identity = machine;
  identity.name = log.name;
  identity.channel = log.channels;
  identity.invert = log.invert;
  settings.urls = identity.urls;
  settings.queue_bytes = static_cast<std::size_t>(log.buffer_bytes);
  static_cast<void>(settings.filter.Set(log.channels, log.invert));
  settings.recorder.split_bytes = static_cast<std::uint64_t>(SplitBytes(log));
  settings.recorder.split_time = SplitTime(log);
  if (Result<std::regex> trigger = CompileExpression(log.trigger); trigger && !log.trigger.empty()) {
    PreTrigger& pre_trigger = settings.recorder.pre_trigger.emplace();
    pre_trigger.trigger = std::move(*trigger);
    pre_trigger.before = log.pre_trigger;
    pre_trigger.after = log.post_trigger;
  }
  settings.writer.name = log.name;
  settings.writer.sync_interval = log.sync;
  settings.writer.retention = {log.quota_bytes, log.keep / kMicrosecond};
  return settings;
}

// The logs of the machine's file. Several machines may share a folder.
void PlanLogs(const MachineConfig& machine, const LogIdentity& identity, RecordPlan& plan) {
  plan.folder = LogDirectory(machine);
  for (const LogConfig& log : machine.recorder.logs) {
    RecordingSettings& settings = plan.logs.emplace_back(SettingsOf(log, identity));
    settings.writer.folder = plan.folder;
    settings.writer.name = machine.machine + '-' + log.name;
  }
}

}  // namespace

void RecordOptions::AddTo(CLI::App& command) {
  command_ = &command;
  const CLI::AsSizeValue size(false);
  const auto seconds = [] {
    return CLI::AsNumberWithUnit(
        std::map<std::string, double>{
            {"s", 1}, {"m", 60}, {"h", 3'600}, {"d", 86'400}, {"w", 604'800}, {"y", 31'557'600}},
        CLI::AsNumberWithUnit::CASE_SENSITIVE, "TIME");
  };
  command.add_option(
      "FILE", file,
      "The log, or the folder of logs NAME_<time>.lcm (default: the logs of the machine's file, else here)");
  config.AddTo(command, ConfigOption::Form::kOptionOnly);
  command.add_option("--url", urls, "LCM URL instead of the file's two; again for more")->type_name("URL");
  command.add_option("--channel", log.channels, "Only channels in whose name this is found; ^ and $ anchor it")
      ->type_name("REGEX");
  command.add_flag("--invert", log.invert, "All but those");
  command.add_option("--split-size", log.split_bytes, "A new log before it grows beyond this: 100MB, 2GB")
      ->transform(size)
      ->type_name("SIZE");
  command.add_option("--split-time", split_s, "A new log after so long: 90s, 15m, 1h, 1d")
      ->transform(seconds())
      ->check(CLI::Range(1.0, 1e9))
      ->type_name("TIME");
  command.add_option("--quota", log.quota_bytes, "Deletes the oldest NAME_*.lcm of the folder beyond this")
      ->transform(size)
      ->type_name("SIZE");
  command.add_option("--keep", keep_s, "Deletes NAME_*.lcm of the folder whose last event is older: 14d, 5y")
      ->transform(seconds())
      ->check(CLI::Range(0.0, 6.3e9))
      ->type_name("TIME");
  command.add_flag("--append", append, "Goes on with FILE; cuts off a torn end first");
  command.add_option("--fsync", sync_ms, "A power failure costs at most so many ms")
      ->check(CLI::Range(std::int64_t{0}, std::int64_t{3'600'000}))
      ->capture_default_str()
      ->type_name("MS");
  command.add_option("--trigger", log.trigger, "Records only around alarms whose 'CHANNEL NAME' this is found in")
      ->type_name("REGEX");
  command.add_option("--pre-trigger", before_s, "With what came so long before")
      ->transform(seconds())
      ->check(CLI::Range(0.0, 3'600.0))
      ->type_name("TIME");
  command.add_option("--post-trigger", after_s, "And so long after the last one")
      ->transform(seconds())
      ->check(CLI::Range(0.0, 86'400.0))
      ->capture_default_str()
      ->type_name("TIME");
  command.add_option("--buffer", log.buffer_bytes, "Memory for what waits for the disk")
      ->transform(size)
      ->default_str("64MB")
      ->type_name("SIZE");
  command.add_option("--name", log.name, "Of the recorder: its logs, RECORDER/<name> (default: the machine's)")
      ->type_name("NAME");
  command.add_flag("--json", json, "One JSON object at the start and at the end");
}

bool RecordOptions::MeansLogsOf(const std::optional<MachineConfig>& machine) const {
  return machine && !machine->recorder.logs.empty() && file.empty() && urls.empty();
}

std::string RecordOptions::ShapesLog() const {
  for (const CLI::Option* option : command_->get_options()) {
    const std::string name = option->get_name();
    if (option->count() == 0 || name == "--config" || name == "--json") continue;
    return name +
           " is for a log of its own: name it, or its folder (. is this one). Without a name, the logs of the " +
           "machine's file are written (recorder:), as that says";
  }
  return "";
}

RecordPlan MakeRecordPlan(const RecordOptions& options, const std::optional<MachineConfig>& machine) {
  RecordPlan plan;
  const LcmConfig lcm = machine ? machine->lcm : LcmConfig();
  plan.prefix = lcm.prefix;
  LogIdentity identity;
  identity.host = HostName();
  identity.urls = options.urls.empty() ? std::vector<std::string>{lcm.url, lcm.command_url} : options.urls;
  if (machine) identity.machine = machine->text;
  if (options.MeansLogsOf(machine)) {
    plan.problem = options.ShapesLog();
    if (plan.problem.empty()) PlanLogs(*machine, identity, plan);
    return plan;
  }
  const LogConfig log = LogOf(options, machine);
  const bool names_logs = IsFolder(options.file);
  plan.problem = Contradiction(options, log, names_logs);
  if (!plan.problem.empty()) return plan;
  LogWriterSettings& writer = plan.logs.emplace_back(SettingsOf(log, identity)).writer;
  if (names_logs) {
    writer.folder = options.file.empty() ? "." : options.file;
  } else {
    writer.file = options.file;
  }
  return plan;
}

}  // namespace axlecast
