#include "tools/axlecast/record_options.h"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <utility>

namespace axlecast {
namespace {

constexpr std::uint64_t kLeastSplit = 1 << 20;  // bytes: every log carries some 60 kB of header
constexpr std::uint64_t kLogsInQuota = 8;       // unless --split-size or --split-time
constexpr std::size_t kLongestName = 24;

MonoNs Nanoseconds(double seconds) { return static_cast<MonoNs>(std::llround(seconds * 1e9)); }

std::string HostName() {
  std::array<char, 256> host{};
  return gethostname(host.data(), host.size() - 1) == 0 ? host.data() : "";
}

bool IsName(const std::string& name) {
  return !name.empty() && name.size() <= kLongestName &&
         name.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-") ==
             std::string::npos;
}

bool IsFolder(const std::string& path) {
  std::error_code error;
  return path.empty() || path.ends_with('/') || std::filesystem::is_directory(path, error);
}

std::string Contradiction(const RecordOptions& options, bool names_logs) {
  if (options.append && names_logs) return "--append needs the file that it goes on with";
  if (options.append && !options.trigger.empty()) return "--append and --trigger exclude each other";
  if (options.quota_bytes > 0 && !names_logs) {
    return "--quota deletes only logs that record has named itself: give a folder instead of a file, or nothing";
  }
  if (options.split_bytes > 0 && options.split_bytes < kLeastSplit) return "--split-size is at least 1 MB";
  if (options.quota_bytes > 0 && options.quota_bytes < 2 * kLeastSplit) return "--quota is at least 2 MB";
  if (options.quota_bytes > 0 && options.split_bytes > options.quota_bytes / 2) {
    return "--split-size is at most half of --quota: the log being written is never deleted";
  }
  if (!options.trigger.empty() && options.before_s <= 0) return "--trigger needs --pre-trigger SECONDS";
  if (options.trigger.empty() && options.before_s > 0) return "--pre-trigger needs --trigger REGEX";
  return "";
}

void PlanWriter(const RecordOptions& options, bool names_logs, RecordPlan& plan) {
  LogWriterSettings& writer = plan.settings.writer;
  writer.name = plan.settings.recorder.identity.name;
  writer.sync_interval = options.sync_ms * kMillisecond;
  if (names_logs) {
    writer.folder = options.file.empty() ? "." : options.file;
  } else {
    writer.file = options.file;
  }
  writer.retention.quota_bytes = static_cast<std::int64_t>(options.quota_bytes);
}

void PlanSplit(const RecordOptions& options, RecorderSettings& recorder) {
  recorder.split_bytes = options.split_bytes;
  recorder.split_time = Nanoseconds(options.split_s);
  if (options.quota_bytes > 0 && options.split_bytes == 0) {
    recorder.split_bytes = std::max(kLeastSplit, options.quota_bytes / kLogsInQuota);
  }
}

}  // namespace

void RecordOptions::AddTo(CLI::App& command) {
  const CLI::AsSizeValue size(false);
  const auto seconds = [] {
    return CLI::AsNumberWithUnit(std::map<std::string, double>{{"s", 1}, {"m", 60}, {"h", 3'600}, {"d", 86'400}},
                                 CLI::AsNumberWithUnit::CASE_SENSITIVE, "TIME");
  };
  command.add_option("FILE", file, "The log, or the folder of logs NAME_<time>.lcm (default: the current one)");
  config.AddTo(command, ConfigOption::Form::kOptionOnly);
  command.add_option("--url", urls, "LCM URL instead of the file's two; again for more")->type_name("URL");
  command.add_option("--channel", channel, "Only channels in whose name this is found; ^ and $ anchor it")
      ->type_name("REGEX");
  command.add_flag("--invert", invert, "All but those");
  command.add_option("--split-size", split_bytes, "A new log before it grows beyond this: 100MB, 2GB")
      ->transform(size)
      ->type_name("SIZE");
  command.add_option("--split-time", split_s, "A new log after so long: 90s, 15m, 1h, 1d")
      ->transform(seconds())
      ->check(CLI::Range(1.0, 1e9))
      ->type_name("TIME");
  command.add_option("--quota", quota_bytes, "Deletes the oldest NAME_*.lcm of the folder beyond this")
      ->transform(size)
      ->type_name("SIZE");
  command.add_flag("--append", append, "Goes on with FILE; cuts off a torn end first");
  command.add_option("--fsync", sync_ms, "A power failure costs at most so many ms")
      ->check(CLI::Range(std::int64_t{0}, std::int64_t{3'600'000}))
      ->capture_default_str()
      ->type_name("MS");
  command.add_option("--trigger", trigger, "Records only around alarms whose 'CHANNEL NAME' this is found in")
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
  command.add_option("--buffer", queue_bytes, "Memory for what waits for the disk")
      ->transform(size)
      ->default_str("64MB")
      ->type_name("SIZE");
  command.add_option("--name", name, "Of the recorder: its logs, RECORDER/<name> (default: the machine's)")
      ->type_name("NAME");
  command.add_flag("--json", json, "One JSON object at the start and at the end");
}

RecordPlan MakeRecordPlan(const RecordOptions& options, const std::optional<MachineConfig>& machine) {
  RecordPlan plan;
  RecordingSettings& settings = plan.settings;
  LogIdentity& identity = settings.recorder.identity;
  identity.name = !options.name.empty() ? options.name : machine ? machine->machine : "axlecast";
  identity.host = HostName();
  identity.channel = options.channel;
  identity.invert = options.invert;
  const LcmConfig lcm = machine ? machine->lcm : LcmConfig();
  if (machine) identity.machine = machine->text;
  plan.prefix = lcm.prefix;
  settings.urls = options.urls.empty() ? std::vector<std::string>{lcm.url, lcm.command_url} : options.urls;
  identity.urls = settings.urls;
  settings.queue_bytes = options.queue_bytes;

  const bool names_logs = IsFolder(options.file);
  plan.problem = Contradiction(options, names_logs);
  if (plan.problem.empty() && !IsName(identity.name)) {
    plan.problem = "--name '" + identity.name + "' is no name: 1 to 24 of letters, digits, _ and -";
  }
  if (plan.problem.empty()) plan.problem = settings.filter.Set(options.channel, options.invert);
  if (!plan.problem.empty()) return plan;
  if (!options.trigger.empty()) {
    auto trigger = CompileExpression(options.trigger, plan.problem);
    if (!trigger) return plan;
    PreTrigger& pre_trigger = settings.recorder.pre_trigger.emplace();
    pre_trigger.trigger = std::move(*trigger);
    pre_trigger.before = Nanoseconds(options.before_s);
    pre_trigger.after = Nanoseconds(options.after_s);
  }
  PlanSplit(options, settings.recorder);
  PlanWriter(options, names_logs, plan);
  return plan;
}

}  // namespace axlecast
