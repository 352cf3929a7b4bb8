#include "tools/axlecast/common/subcommands.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <iostream>
#include <memory>
#include <optional>
#include <utility>

#include "core/base/result.h"
#include "core/base/utc_text.h"
#include "core/command/commands.h"
#include "core/messages/enum_names.h"
#include "core/messages/json/field.h"
#include "platform/os/process.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/command/format_journal.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/live/format_device.h"

namespace axlecast {
namespace {

// The journal of a command, and the machine that it belongs to, if its file was read.
struct JournalPlace {
  std::string file;
  std::optional<MachineConfig> machine;
};

// The bridge's journal: --journal FILE, else that of the machine's file.
struct JournalOption {
  ConfigOption config;
  std::string journal;

  // Adds --journal and --config. The object must outlive the parsing.
  void AddTo(CLI::App& command) {
    config.AddTo(command, ConfigOption::Form::kOptionOnly);
    command.add_option("--journal", journal, "The bridge's journal; default that of the machine's file")
        ->type_name("FILE");
  }
  // Fails if the machine's file is needed and cannot be read.
  [[nodiscard]] Result<JournalPlace> Find() const {
    if (!journal.empty() && !config.Given()) return JournalPlace{.file = journal, .machine = std::nullopt};
    Result<MachineConfig> machine = config.Load();
    if (!machine) return Failure(machine.error());
    return JournalPlace{.file = journal.empty() ? JournalFile(*machine) : journal, .machine = std::move(*machine)};
  }
};

constexpr const char* kDatumExitCodes =
    "Exit code 1: the journal contains nothing about the device, or cannot be read; 2: no such device";

struct DatumOptions {
  JournalOption journal;
  std::string device;
  bool json = false;
};

// Reports that the journal has no entry of the device, or of any device.
int NothingKnown(const JournalPlace& place, const std::string& device) {
  if (device.empty()) return Fail(place.file + " contains no device yet", kExitDone);
  if (place.machine && place.machine->BusOf(device) == nullptr) {
    return Fail(UnknownDevice(*place.machine, device), kExitUsage);
  }
  if (!place.machine) return Fail(place.file + " contains no device '" + device + "'", kExitBad);
  return Fail(place.file + " contains nothing about " + device + " yet", kExitBad);
}

int ShowDatums(const DatumOptions& options) {
  const auto place = options.journal.Find();
  if (!place) return options.journal.config.Fail(place.error());
  HistoryReader reader(place->file);
  std::vector<DeviceRecord> devices = reader.Devices();
  if (!reader.state()) return Fail(reader.state().error().text, kExitBad);
  if (!options.device.empty()) {
    std::erase_if(devices, [&](const DeviceRecord& device) { return device.device != options.device; });
  }
  if (devices.empty()) return NothingKnown(*place, options.device);
  std::string text;
  for (const DeviceRecord& device : devices) {
    const std::int64_t budget = place->machine ? WriteBudget(*place->machine, device.device) : 0;
    text += options.json ? JsonLine(DatumJson(device, budget)) + '\n' : DatumText(device, budget);
  }
  static_cast<void>(WriteOut(text));
  return kExitDone;
}

int ShowDatumHistory(const DatumOptions& options) {
  const auto place = options.journal.Find();
  if (!place) return options.journal.config.Fail(place.error());
  HistoryReader reader(place->file);
  const std::vector<DatumHistory> datums = reader.Datums(options.device);
  if (!reader.state()) return Fail(reader.state().error().text, kExitBad);
  if (datums.empty()) {
    const auto devices = reader.Devices();
    const bool known =
        std::ranges::any_of(devices, [&](const DeviceRecord& device) { return device.device == options.device; });
    return known ? Fail("no datum of " + options.device + " was ever set", kExitDone)
                 : NothingKnown(*place, options.device);
  }
  std::string text = options.json ? "" : DatumHistoryHeading();
  for (const DatumHistory& datum : datums) {
    text += options.json ? JsonLine(DatumHistoryJson(options.device, datum)) + '\n' : DatumHistoryLine(datum);
  }
  static_cast<void>(WriteOut(text));
  return kExitDone;
}

void AddDatumShow(CLI::App& datum, int& exit_code) {
  auto options = std::make_shared<DatumOptions>();
  CLI::App* command = datum.add_subcommand("show", "Show the datum in force, reference, last position and wear");
  command->add_option("DEVICE", options->device, "Only this device; default all devices in the journal");
  command->add_flag("--json", options->json, "Print one JSON object per line, one for each device");
  options->journal.AddTo(*command);
  command->footer(std::string("examples:\n"
                              "  axlecast datum show\n"
                              "  axlecast datum show axis1 --json | jq .datum.counts\n") +
                  kDatumExitCodes);
  command->callback([options, &exit_code] { exit_code = ShowDatums(*options); });
}

void AddDatumHistory(CLI::App& datum, int& exit_code) {
  auto options = std::make_shared<DatumOptions>();
  CLI::App* command = datum.add_subcommand("history", "List all datums of a device, newest first");
  command->add_option("DEVICE", options->device, "The device")->required();
  command->add_flag("--json", options->json, "Print one JSON object per line, one for each datum");
  options->journal.AddTo(*command);
  command->footer(std::string("example: axlecast datum history axis1\n") + kDatumExitCodes);
  command->callback([options, &exit_code] { exit_code = ShowDatumHistory(*options); });
}

constexpr int kFollowMs = 250;
constexpr std::int64_t kShown = 100;     // unless --limit
constexpr std::int64_t kCandidates = 9;  // maximum number of ids printed for an ambiguous prefix
constexpr std::int8_t kFirstState = command_status_t::STATE_ACCEPTED;
constexpr std::int8_t kLastState = command_status_t::STATE_INDETERMINATE;

struct HistoryOptions {
  JournalOption journal;
  HistoryFilter filter;
  std::string outcome;
  std::string since;
  std::string until;
  std::int64_t limit = kShown;  // 0: all
  bool events = false;
  bool follow = false;
  bool json = false;
};

// Converts the words of the filter to numbers. Fails if one is malformed.
Result<> ParseFilter(HistoryOptions& options) {
  HistoryFilter& filter = options.filter;
  for (char& digit : filter.id) {
    if (digit >= 'A' && digit <= 'F') digit = static_cast<char>(digit - 'A' + 'a');
  }
  if (filter.id.size() > 32 || filter.id.find_first_not_of("0123456789abcdef") != std::string::npos) {
    return Failure("'" + filter.id + "' is no command's id: it is 32 hex digits, or the first of them");
  }
  for (std::int8_t state = kFirstState; state <= kLastState; ++state) {
    if (StateName(state) == options.outcome) filter.state = state;
  }
  const std::int64_t now = SystemClock().UtcMicroseconds();
  filter.since_utime = ParseUtc(options.since, now);
  filter.until_utime = ParseUtc(options.until, now);
  for (const auto& [text, time] :
       {std::pair(options.since, filter.since_utime), {options.until, filter.until_utime}}) {
    if (!text.empty() && !time) {
      return Failure("'" + text +
                     "' is no time: write 90s, 15m, 2h, 3d (ago), 2026-11-21 or 2026-11-21T07:00:05 (UTC)");
    }
  }
  if (options.limit > 0) filter.limit = options.limit;
  return {};
}

int ShowOne(HistoryReader& reader, const HistoryOptions& options) {
  const std::vector<CommandRow> found = reader.Commands({.id = options.filter.id, .limit = kCandidates});
  if (!reader.state()) return Fail(reader.state().error().text, kExitBad);
  if (found.empty())
    return Fail("the journal holds no command whose id begins with " + options.filter.id, kExitBad);
  if (found.size() > 1) {
    std::string several = "several ids begin with " + options.filter.id + ":";
    for (const CommandRow& command : found) several += "\n  " + IdText(IdOf(command.record.status.id));
    return Fail(several, kExitBad);
  }
  const std::vector<CommandStep> steps = reader.Steps(found.front().number);
  if (!reader.state()) return Fail(reader.state().error().text, kExitBad);
  Show(CommandJson(found.front(), steps), CommandText(found.front(), steps), options.json);
  return kExitDone;
}

// Commands and events as lines, in the order of their times.
class Listing {
 public:
  // Reads the entries between the marks, all if there are none.
  Listing(HistoryReader& reader, const HistoryFilter& filter, const HistoryOptions& options, auto... marks) {
    const auto add = [&](std::int64_t unix_us, const auto& entry) {
      lines_.emplace_back(unix_us, options.json ? JsonLine(HistoryJson(entry)) + '\n' : HistoryLine(entry));
    };
    for (const CommandRow& command : reader.Commands(filter, marks...)) add(command.record.utime, command);
    if (options.events) {
      for (const AxisEvent& event : reader.Events(filter, marks...)) add(event.utime, event);
    }
    std::ranges::stable_sort(lines_, [](const auto& one, const auto& other) { return one.first < other.first; });
  }
  // Keeps only the newest. Returns true if some were removed.
  bool Cut(const std::optional<std::int64_t>& limit) {
    if (!limit || lines_.size() <= static_cast<std::size_t>(*limit)) return false;
    lines_.erase(lines_.begin(), lines_.end() - *limit);
    return true;
  }
  [[nodiscard]] bool empty() const { return lines_.empty(); }
  [[nodiscard]] std::string Text() const {
    std::string text;
    for (const auto& [unix_us, line] : lines_) text += line;
    return text;
  }

 private:
  std::vector<std::pair<std::int64_t, std::string>> lines_;
};

// Prints new entries until it is stopped or its reader is gone.
int Follow(HistoryReader& reader, const HistoryOptions& options, HistoryReader::Mark from) {
  HistoryFilter filter = options.filter;
  filter.limit.reset();
  const StopSignal stop;
  while (!stop.Wait(kFollowMs)) {
    const HistoryReader::Mark to = reader.Now();
    const Listing listing(reader, filter, options, from, to);
    if (!reader.state()) return Fail(reader.state().error().text, kExitBad);
    if (!WriteOut(listing.Text())) break;
    from = to;
  }
  return kExitDone;
}

int List(HistoryReader& reader, const HistoryOptions& options) {
  const HistoryReader::Mark mark = reader.Now();
  HistoryFilter filter = options.filter;
  if (filter.limit) ++*filter.limit;  // to know whether there are more
  Listing listing(reader, filter, options);
  if (!reader.state()) return Fail(reader.state().error().text, kExitBad);
  if (listing.Cut(options.filter.limit)) {
    std::cerr << "the newest " << *options.filter.limit << "; --limit N shows more, --limit 0 all\n";
  }
  if (listing.empty() && !options.follow) std::cerr << "the journal contains no such entry\n";
  const bool heading = !options.json && (options.follow || !listing.empty());
  if (!WriteOut((heading ? HistoryHeading() : "") + listing.Text()) || !options.follow) return kExitDone;
  return Follow(reader, options, mark);
}

int ShowHistory(HistoryOptions options) {
  if (const auto parsed = ParseFilter(options); !parsed) return Fail(parsed.error().text, kExitUsage);
  const auto place = options.journal.Find();
  if (!place) return options.journal.config.Fail(place.error());
  HistoryReader reader(place->file);
  if (!reader.state()) return Fail(reader.state().error().text, kExitBad);
  return options.filter.id.empty() ? List(reader, options) : ShowOne(reader, options);
}

std::vector<std::string> StateNames() {
  std::vector<std::string> names;
  for (std::int8_t state = kFirstState; state <= kLastState; ++state) {
    names.emplace_back(StateName(state));
  }
  return names;
}

}  // namespace

void AddDatumCommands(CLI::App& app, int& exit_code) {
  CLI::App* datum = app.add_subcommand("datum", "Show or undo the datum, from which positions are counted");
  datum->require_subcommand(1);
  AddDatumShow(*datum, exit_code);
  AddDatumHistory(*datum, exit_code);
  AddDatumUndo(*datum, exit_code);
}

void AddHistoryCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<HistoryOptions>();
  CLI::App* command = app.add_subcommand("history", "List commands with time, operator and outcome");
  CLI::Option* id = command->add_option("ID", options->filter.id, "Show one command: its id, or the first digits");
  command->add_option("--device", options->filter.device, "Only this device")->type_name("D");
  command->add_option("--operation", options->filter.operation, "Only this operation")->type_name("O");
  command->add_option("--who", options->filter.who, "Only commands of this key; `unsigned` for those without")
      ->type_name("W");
  command->add_option("--outcome", options->outcome, "Only commands with this outcome")
      ->check(CLI::IsMember(StateNames()))
      ->type_name("WORD");
  command->add_option("--since", options->since, "Only entries since: 2h, 3d (ago), 2026-11-21, 2026-11-21T07:00")
      ->type_name("T");
  command->add_option("--until", options->until, "Only entries before")->type_name("T");
  command->add_option("--limit", options->limit, "Only the newest N entries; 0 all")
      ->check(CLI::Range(std::int64_t{0}, std::int64_t{1} << 40))
      ->capture_default_str()
      ->type_name("N");
  CLI::Option* events = command->add_flag("--events", options->events,
                                          "Also list events of devices without a command: moved while off, ...");
  command->add_flag("--follow", options->follow, "Keep running and print each command when it ends");
  for (const char* filter : {"--operation", "--who", "--outcome"}) events->excludes(command->get_option(filter));
  for (CLI::Option* option : command->get_options()) {
    if (option != id && option != command->get_help_ptr()) id->excludes(option);
  }
  command->add_flag("--json", options->json, "Print one JSON object per line");
  options->journal.AddTo(*command);
  command->footer(
      "examples:\n"
      "  axlecast history --device axis1 --since 2h\n"
      "  axlecast history --outcome indeterminate --limit 0 --json\n"
      "  axlecast history 0a1b2c3d\n"
      "  axlecast history --events --follow\n"
      "It reads the journal's file: the bridge need not run. Exit code 0, also if nothing is found;\n"
      "1: no such id, or the journal cannot be read.");
  command->callback([options, &exit_code] { exit_code = ShowHistory(*options); });
}

}  // namespace axlecast
