#include "tools/axlecast/logs/record.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/base/expression.h"
#include "core/base/result.h"
#include "core/base/text.h"
#include "core/messages/json/field.h"
#include "core/messages/lcm_url.h"
#include "tools/axlecast/common/program.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/recorder/recording_health.h"

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

// Returns, for example, "--split-size: at least 1MB".
std::string OptionText(const ConfigFault& fault) {
  std::string option = fault.key;
  std::replace(option.begin(), option.end(), '_', '-');
  return (option == "channels" ? "--channel" : "--" + option) + ": " + fault.text;
}

// Returns an error for a URL from which nothing can be received.
Result<> CheckUrls(const std::vector<std::string>& urls) {
  for (const std::string& url : urls) {
    if (url.starts_with("file://")) {
      return Failure(
          "--url " + url +
          ": a log cannot be recorded again: use `axlecast log filter` or `merge` to make another log, or "
          "`axlecast replay` to send its messages");
    }
    if (url.starts_with("memq://"))
      return Failure("--url " + url + ": memq:// does not leave its process: give a udpm:// or tcpq:// URL");
  }
  return {};
}

Result<> CheckOptions(const RecordOptions& options, const LogConfig& log, bool names_logs) {
  if (options.append && names_logs) return Failure("--append needs the FILE to continue");
  if (options.append && !log.trigger.empty()) {
    return Failure(
        "--append continues one log, but --trigger makes a log for each trigger: leave out --append, and give a "
        "folder; `axlecast log merge` joins the logs");
  }
  if ((log.quota_bytes > 0 || log.keep > 0) && !names_logs) {
    return Failure("--quota and --keep delete only logs with generated names: give a folder instead of a file");
  }
  if (log.compress && !names_logs) {
    return Failure("--compress replaces only logs with generated names: give a folder instead of a file");
  }
  if (!IsName(log.name))
    return Failure("--name '" + log.name + "' is not a name: use 1 to 24 letters, digits, _ and -");
  if (Result<> urls = CheckUrls(options.urls); !urls) return urls;
  const std::vector<ConfigFault> faults = FaultsOf(log);
  if (!faults.empty()) return Failure(OptionText(faults.front()));
  return {};
}

// Returns the log that the command line defines.
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

// `log` must be valid. `machine_name`: as RecordingSettings::machine.
RecordingSettings SettingsOf(const LogConfig& log, const LogIdentity& machine, const std::string& machine_name) {
  RecordingSettings settings;
  LogIdentity& identity = settings.recorder.identity;
  identity = machine;
  identity.name = log.name;
  identity.channel = log.channels;
  identity.invert = log.invert;
  settings.urls = identity.urls;
  settings.machine = machine_name;
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
  settings.writer.retention.quota_bytes = log.quota_bytes;
  settings.writer.retention.keep_us = log.keep / kMicrosecond;
  settings.writer.compress = log.compress;
  return settings;
}

// Adds the logs of the machine's file. Several machines may share a folder.
void PlanLogs(const MachineConfig& machine, const LogIdentity& identity, const std::string& machine_name,
              RecordPlan& plan) {
  plan.folder = LogDirectory(machine);
  for (const LogConfig& log : machine.recorder.logs) {
    RecordingSettings& settings = plan.logs.emplace_back(SettingsOf(log, identity, machine_name));
    settings.writer.folder = plan.folder;
    settings.writer.name = machine.machine + '-' + log.name;
    if (machine.ship.database.empty()) continue;
    settings.writer.retention.needs_shipping = true;
    settings.writer.retention.reserve_bytes = machine.ship.reserve_bytes;
    settings.writer.retention.reserve_percent = machine.ship.reserve_percent;
  }
}

constexpr std::size_t kShown = 8;  // maximum number of senders and of channels in the summary

// Returns, for example, "3.3 h".
std::string DurationText(double seconds) {
  if (seconds < 120) return Decimal(seconds, 0) + " s";
  if (seconds < 7'200) return Decimal(seconds / 60, 0) + " min";
  if (seconds < 172'800) return Decimal(seconds / 3'600, 1) + " h";
  return Decimal(seconds / 86'400, 0) + " days";
}

const char* StateText(std::int8_t state) {
  switch (state) {
    case recorder_health_t::STATE_PRE_TRIGGER:
      return "waiting ";
    case recorder_health_t::STATE_DISK_FULL:
      return "DISK FULL ";
    case recorder_health_t::STATE_ERROR:
      return "ERROR ";
    default:
      return "";
  }
}

std::string Count(std::int64_t count, const char* what) { return std::to_string(count) + ' ' + what; }

// Returns the number of datagrams that the kernel dropped, and whose gap no later message has revealed.
std::int64_t Undetected(const RecordingStatus& status) {
  return std::max<std::int64_t>(status.receiver.kernel_dropped - status.receiver.lost, 0);
}

std::string LossLines(const RecordingStatus& status) {
  std::string text;
  const ReceiverCounts& counts = status.receiver;
  if (counts.lost > 0) text += "  " + Count(counts.lost, "missing by the senders' sequence numbers\n");
  if (counts.overflow > 0)
    text += "  " + Count(counts.overflow, "found no space in memory (--buffer): the disk is slow\n");
  if (status.unwritten > 0) text += "  " + Count(status.unwritten, "not written to the disk\n");
  if (counts.kernel_dropped > 0) {
    text +=
        "  " + Count(counts.kernel_dropped, "datagrams dropped by the kernel (recv_buf_size, net.core.rmem_max)\n");
  }
  if (Undetected(status) > 0) {
    text +=
        "  of these at least " + Count(Undetected(status), "from senders without a message after (or before)\n");
  }
  return text;
}

nlohmann::ordered_json SenderJson(const SenderCount& sender) {
  return {{"sender", SenderText(sender.sender)},
          {"received", sender.received},
          {"lost", sender.lost},
          {"repeated", sender.repeated}};
}

// Returns, for example, "12.3 MB".
std::string ByteText(double bytes) {
  constexpr std::array<const char*, 5> kUnits = {"B", "kB", "MB", "GB", "TB"};
  std::size_t unit = 0;
  for (; bytes >= 1'000 && unit + 1 < kUnits.size(); ++unit) bytes /= 1'000;
  return Decimal(bytes, unit == 0 ? 0 : 1) + ' ' + kUnits[unit];
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
      "Log, or folder of logs NAME_<time>.lcm (default: the logs of the machine's file, else the current folder)");
  config.AddTo(command, ConfigOption::Form::kOptionOnly);
  command
      .add_option("--url", urls,
                  "Receive from this LCM URL instead of the two URLs of the machine's file; may be repeated")
      ->type_name("URL");
  command.add_option("--channel", log.channels, "Record only channels that match REGEX; ^ and $ anchor it")
      ->type_name("REGEX");
  command.add_flag("--invert", log.invert, "Record only channels that do not match");
  command.add_option("--split-size", log.split_bytes, "Begin a new log before a log exceeds SIZE: 100MB, 2GB")
      ->transform(size)
      ->type_name("SIZE");
  command.add_option("--split-time", split_s, "Begin a new log after TIME: 90s, 15m, 1h, 1d")
      ->transform(seconds())
      ->check(CLI::Range(1.0, 1e9))
      ->type_name("TIME");
  command.add_option("--quota", log.quota_bytes, "Delete the oldest NAME_*.lcm of the folder if they exceed SIZE")
      ->transform(size)
      ->type_name("SIZE");
  command
      .add_option("--keep", keep_s,
                  "Delete NAME_*.lcm of the folder if their last event is older than TIME: 14d, 5y")
      ->transform(seconds())
      ->check(CLI::Range(0.0, 6.3e9))
      ->type_name("TIME");
  command.add_flag("--compress", log.compress, "Compress each closed log of the folder into NAME_*.lcm.zst (zstd)");
  command.add_flag("--append", append, "Continue FILE; a torn end is removed first");
  command
      .add_option("--fsync", sync_ms,
                  "Write to the disk at least every MS milliseconds: the maximum loss at a power failure")
      ->check(CLI::Range(std::int64_t{0}, std::int64_t{3'600'000}))
      ->capture_default_str()
      ->type_name("MS");
  command.add_option("--trigger", log.trigger, "Record only around alarms whose 'CHANNEL NAME' matches REGEX")
      ->type_name("REGEX");
  command.add_option("--pre-trigger", before_s, "Also keep the last TIME before the trigger")
      ->transform(seconds())
      ->check(CLI::Range(0.0, 3'600.0))
      ->type_name("TIME");
  command.add_option("--post-trigger", after_s, "Keep recording for TIME after the last trigger")
      ->transform(seconds())
      ->check(CLI::Range(0.0, 86'400.0))
      ->capture_default_str()
      ->type_name("TIME");
  command
      .add_option("--buffer", log.buffer_bytes, "Use at most SIZE of memory for messages that wait for the disk")
      ->transform(size)
      ->default_str("64MB")
      ->type_name("SIZE");
  command
      .add_option("--name", log.name, "Name of the recorder, its logs and RECORDER/<name> (default: the machine's)")
      ->type_name("NAME");
  command.add_flag("--json", json, "Print one JSON object at the start and at the end");
}

bool RecordOptions::UsesLogsOf(const std::optional<MachineConfig>& machine) const {
  return machine && !machine->recorder.logs.empty() && file.empty() && urls.empty();
}

Result<> RecordOptions::CheckNoLogOption() const {
  for (const CLI::Option* option : command_->get_options()) {
    const std::string name = option->get_name();
    if (option->count() == 0 || name == "--config" || name == "--json") continue;
    return Failure(
        name +
        " needs a FILE or a folder (. is the current one). Without it, the logs of the machine's file are "
        "recorded (recorder:) with the settings of that file");
  }
  return {};
}

Result<RecordPlan> MakeRecordPlan(const RecordOptions& options, const std::optional<MachineConfig>& machine) {
  RecordPlan plan;
  const LcmConfig lcm = machine ? machine->lcm : LcmConfig();
  plan.prefix = lcm.prefix;
  const std::string machine_name = machine && options.urls.empty() ? machine->machine : "";
  LogIdentity identity;
  identity.host = HostName();
  identity.urls = options.urls.empty() ? std::vector<std::string>{lcm.url, lcm.command_url} : options.urls;
  if (machine) identity.machine = machine->text;
  if (options.UsesLogsOf(machine)) {
    if (const Result<> checked = options.CheckNoLogOption(); !checked) return Failure(checked.error());
    PlanLogs(*machine, identity, machine_name, plan);
    return plan;
  }
  const LogConfig log = LogOf(options, machine);
  const bool names_logs = IsFolder(options.file);
  if (const Result<> checked = CheckOptions(options, log, names_logs); !checked) return Failure(checked.error());
  LogWriterSettings& writer = plan.logs.emplace_back(SettingsOf(log, identity, machine_name)).writer;
  if (names_logs) {
    writer.folder = options.file.empty() ? "." : options.file;
  } else {
    writer.file = options.file;
  }
  return plan;
}

std::string RecordStatusLine(const recorder_health_t& health, const ClosedLogsStatus& closed) {
  std::string line = StateText(health.state);
  line += Decimal(static_cast<double>(health.messages_hz), 0) + " messages/s  ";
  line += ByteText(static_cast<double>(health.bytes_hz)) + "/s  ";
  line += Count(health.messages, "messages") + ", " + ByteText(static_cast<double>(health.total_bytes));
  line += "  lost " + std::to_string(health.lost);
  if (health.kernel_dropped > 0) line += " (kernel " + std::to_string(health.kernel_dropped) + ')';
  line += "  free " + ByteText(static_cast<double>(health.free_bytes));
  if (health.bytes_hz > 1) {
    line +=
        " (" + DurationText(static_cast<double>(health.free_bytes) / static_cast<double>(health.bytes_hz)) + ')';
  }
  if (closed.held_logs > 0) {
    line += "  NOT SHIPPED " + Count(closed.held_logs, closed.held_logs == 1 ? "log, " : "logs, ") +
            ByteText(static_cast<double>(closed.held_bytes));
  }
  if (closed.deleted_unshipped > 0) line += "  DELETED UNSHIPPED " + std::to_string(closed.deleted_unshipped);
  return line;
}

std::string RecordSummary(const RecordingStatus& status) {
  std::string text = Count(status.messages, "messages, ") + ByteText(static_cast<double>(status.bytes)) +
                     (status.disk.file.empty() ? "" : ", last in " + status.disk.file) + '\n';
  if (!status.failure.empty()) text += "ended early: " + status.failure + '\n';
  if (status.disk.damaged || status.unwritten > 0) text += status.disk.last_error + '\n';
  if (status.disk.closed.deleted_unshipped > 0) {
    text += "the disk was nearly full: " + Count(status.disk.closed.deleted_unshipped,
                                                 "logs were deleted before they were shipped (holes.jsonl)\n");
  }
  if (status.early > 0) {
    text += "the pre-trigger memory was full: " + Count(status.early, "messages were removed early\n");
  }
  for (const OtherMachine& machine : status.receiver.machines) {
    text += Count(machine.messages, "messages of ") + NamesOf({machine}) +
            " not recorded: it uses the same LCM group\n";
  }
  if (status.IsComplete()) return text + "nothing was lost\n";
  text += "LOST:\n" + LossLines(status);
  const auto& senders = status.receiver.senders;
  for (std::size_t i = 0; i < std::min(senders.size(), kShown) && senders[i].lost > 0; ++i) {
    text += "  " + Left(SenderText(senders[i].sender), 22) + Count(senders[i].lost, "lost, ") +
            Count(senders[i].received, "received\n");
  }
  for (std::size_t i = 0; i < std::min(status.channels.size(), kShown); ++i) {
    const ChannelLoss& channel = status.channels[i];
    text += "  " + Left(Printable(channel.channel), 22) + Count(channel.lost, "lost, ") +
            Count(channel.received, "recorded\n");
  }
  return text;
}

std::string RecordEndJson(const std::string& name, const RecordingStatus& status) {
  nlohmann::ordered_json json = {{"kind", "end"},
                                 {"name", name},
                                 {"whole", status.IsComplete() && !status.HasFailed()},
                                 {"file", status.disk.file},
                                 {"messages", status.messages},
                                 {"bytes", status.bytes},
                                 {"lost", status.Lost()},
                                 {"lost_by_number", status.receiver.lost},
                                 {"lost_in_memory", status.receiver.overflow},
                                 {"lost_at_disk", status.unwritten},
                                 {"kernel_dropped", status.receiver.kernel_dropped},
                                 {"foreign", status.receiver.not_lcm},
                                 {"left_memory_early", status.early},
                                 {"error", status.failure.empty() ? status.disk.last_error : status.failure}};
  json["senders"] = nlohmann::ordered_json::array();
  for (const SenderCount& sender : status.receiver.senders) json["senders"].push_back(SenderJson(sender));
  json["channels"] = nlohmann::ordered_json::array();
  for (const ChannelLoss& channel : status.channels) {
    json["channels"].push_back(
        {{"channel", channel.channel}, {"received", channel.received}, {"lost", channel.lost}});
  }
  return JsonLine(json);
}

int RecordExitCode(const RecordingStatus& status) {
  if (status.HasFailed()) return kExitFailed;
  return status.IsComplete() ? kExitDone : kExitLosses;
}

}  // namespace axlecast
