#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "platform/os/new_file.h"
#include "tools/axlecast/common/subcommands.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/logs/log_input.h"
#include "tools/convert/conversion.h"
#include "tools/convert/plot.h"

namespace axlecast {
namespace {

// The log and the events that a command converts: LOG, --channel, --invert, --from and --until.
class LogSelection {
 public:
  // The object must outlive the parsing.
  void AddTo(CLI::App& command) {
    command.add_option("LOG", file_, "An LCM event log, of axlecast record or lcm-logger")->required();
    filter_.AddTo(command);
  }

  // Opens the log. If that fails, or an option is invalid, prints the error and returns the exit code.
  [[nodiscard]] std::optional<int> Open() {
    if (!input_.Open(file_)) return kExitBad;
    input_.Read("", [](const LogEvent&, std::size_t) { return false; });
    if (input_.ExitCode() == kExitBad) return kExitBad;
    if (const Result<> parsed = filter_.Parse(input_.log()); !parsed) return Fail(parsed.error().text, kExitUsage);
    return std::nullopt;
  }

  // Return the events of the opened log, and refer to this object. `all` ignores --channel.
  [[nodiscard]] EventRange events() {
    return [this](const EventVisitor& visit) { Visit(visit, true); };
  }
  [[nodiscard]] EventRange all() {
    return [this](const EventVisitor& visit) { Visit(visit, false); };
  }

  // Returns the damaged bytes within the selected time. Call it after all events were read.
  [[nodiscard]] std::size_t damaged_bytes() const { return DamagedBytes(input_.damage()); }
  // See OpenedLog::Loss.
  [[nodiscard]] std::string Loss() const { return input_.file().Loss(); }
  [[nodiscard]] const std::string& damage() const { return input_.file().damage(); }  // OpenedLog
  [[nodiscard]] const std::string& file() const { return file_; }

 private:
  void Visit(const EventVisitor& visit, bool filtered) {
    const auto visit_selected = [&](const LogEvent& event, std::size_t) {
      if (filter_.EndsAt(event)) return false;
      return !(filtered ? filter_.Matches(event) : filter_.MatchesTime(event)) || visit(event);
    };
    input_.Read("", visit_selected, filter_.Begin(input_.log()));
  }

  std::string file_;
  LogFilter filter_;
  LogInput input_;
};

// The output of a conversion: -o FILE, or - for standard output, and --force.
class ConversionOutput {
 public:
  // The object must outlive the parsing.
  void AddTo(CLI::App& command) {
    command.add_option("-o,--output", path_, "Write to FILE; - is standard output")->required()->type_name("FILE");
    command.add_flag("--force", force_, "Replace FILE if it exists");
  }

  // Opens the file. If that fails, prints the error and returns the exit code.
  [[nodiscard]] std::optional<int> Open() {
    if (path_ == "-") return std::nullopt;
    if (!force_ && std::filesystem::exists(path_)) {
      return Fail(path_ + " exists: choose another name, or replace it with --force", kExitUsage);
    }
    file_ = std::make_unique<NewFile>(path_, FileAccess{.mode = 0644});
    if (const Result<> opened = file_->Append(""); !opened) return Fail(opened.error().text, kExitFailed);
    return std::nullopt;
  }

  // Returns false if the write failed.
  bool Write(std::string_view part) {
    constexpr std::size_t kWaiting = 1U << 16;  // bytes that are written to standard output together
    if (file_ != nullptr) return file_->Collect(part);
    waiting_ += part;
    return !closed_ && (waiting_.size() < kWaiting || Flush());
  }

  // Completes the file. Prints an error of the file or of the log. Returns the exit code.
  [[nodiscard]] int Commit(const LogSelection& log) {
    if (file_ == nullptr && !Flush()) return Fail("standard output was closed", kExitFailed);
    if (const Result<> committed = file_ != nullptr ? file_->Commit(force_) : Result<>(); !committed)
      return Fail(committed.error().text, kExitFailed);
    const std::string loss = log.Loss();
    if (!loss.empty()) std::cerr << loss << '\n';
    if (log.damaged_bytes() == 0) return loss.empty() && log.damage().empty() ? kExitDone : kExitLosses;
    std::cerr << log.file() << ": " << log.damaged_bytes()
              << " bytes are damaged, and their events are missing; axlecast log verify shows where\n";
    return kExitLosses;
  }

  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  [[nodiscard]] bool Flush() {
    closed_ = closed_ || !(isatty(STDOUT_FILENO) == 1 ? WriteOut(waiting_) : WriteBytes(waiting_));
    waiting_.clear();
    return !closed_;
  }

  std::string path_;
  bool force_ = false;
  std::unique_ptr<NewFile> file_;  // null for standard output
  std::string waiting_;            // for standard output
  bool closed_ = false;            // standard output
};

struct LogConvertOptions {
  LogSelection log;
  ConversionOutput output;
  std::string format;
  double grid_s = 0;
  double max_age_s = 0;
};

std::int64_t Microseconds(double seconds) { return std::llround(seconds * 1e6); }

Result<Conversion> Write(LogConvertOptions& options, const Output& out) {
  const EventRange events = options.log.events();
  if (options.format == "mcap") return WriteMcap(events, out);
  if (options.format == "candump") return WriteCandump(events, out);
  if (options.format == "pcap") return WritePcap(events, out);
  if (options.grid_s == 0) return WriteCsvTable(events, out);
  const TimeGrid grid{.period_us = Microseconds(options.grid_s), .max_age_us = Microseconds(options.max_age_s)};
  return WriteCsvGrid(events, options.log.all(), grid, out);
}

int RunLogConvert(LogConvertOptions& options) {
  if (options.grid_s > 0 && options.format != "csv") {
    return Fail("--grid needs --to csv", kExitUsage);
  }
  if (const std::optional<int> failed = options.log.Open()) return *failed;
  if (const std::optional<int> failed = options.output.Open()) return *failed;
  const Result<Conversion> done =
      Write(options, [&options](std::string_view part) { return options.output.Write(part); });
  if (!done) return Fail(options.log.file() + ": " + done.error().text, kExitBad);
  const int exit_code = options.output.Commit(options.log);
  if (exit_code == kExitFailed) return exit_code;
  const bool rows = options.grid_s > 0;
  std::cerr << done->written << (rows ? " rows" : " messages or frames") << " written";
  if (done->left_out > 0)
    std::cerr << "; " << done->left_out << " events left out: this format cannot contain them";
  std::cerr << '\n';
  if (!done->note.empty()) std::cerr << done->note << '\n';
  return exit_code;
}

struct LogPlotOptions {
  LogSelection log;
  ConversionOutput output;
  std::vector<std::string> fields;
  std::string title;
};

int RunLogPlot(LogPlotOptions& options) {
  std::vector<PlotField> fields;
  for (const std::string& text : options.fields) {
    const auto field = ParsePlotField(text);
    if (!field)
      return Fail("'" + text + "' is not a field: write CHANNEL:NAME, for example POSITION/axis1:value",
                  kExitUsage);
    fields.push_back(*field);
  }
  const std::string ending = std::filesystem::path(options.output.path()).extension();
  if (ending != ".svg" && ending != ".png")
    return Fail("-o: the name must end in .svg or .png, which defines the format", kExitUsage);
  if (const std::optional<int> failed = options.log.Open()) return *failed;
  if (const std::optional<int> failed = options.output.Open()) return *failed;
  const Result<PlotData> data = CollectPlot(options.log.events(), fields, kPlotColumns);
  if (!data) return Fail(options.log.file() + ": " + data.error().text, kExitBad);
  const std::string title =
      options.title.empty() ? std::filesystem::path(options.log.file()).filename().string() : options.title;
  const Result<std::string> picture = ending == ".svg" ? PlotSvg(title, *data) : PlotPng(title, *data);
  if (!picture) return Fail(picture.error().text, kExitBad);
  static_cast<void>(options.output.Write(*picture));
  return options.output.Commit(options.log);
}

}  // namespace

void AddLogConvertCommand(CLI::App& log, int& exit_code) {
  auto options = std::make_shared<LogConvertOptions>();
  CLI::App* command = log.add_subcommand("convert", "Convert a log to CSV, MCAP, candump or pcap");
  options->log.AddTo(*command);
  command
      ->add_option("--to", options->format,
                   "Convert to csv, mcap (Foxglove, PlotJuggler), candump or pcap (Wireshark)")
      ->required()
      ->check(CLI::IsMember({"csv", "mcap", "candump", "pcap"}))
      ->type_name("FORMAT");
  options->output.AddTo(*command);
  const std::map<std::string, double> units = {{"us", 1e-6}, {"ms", 1e-3}, {"s", 1}};
  CLI::Option* grid =
      command
          ->add_option(
              "--grid", options->grid_s,
              "Write CSV with all positions at the same times, at this interval (10ms); else one row per message")
          ->transform(CLI::AsNumberWithUnit(units))
          ->check(CLI::Range(1e-6, 86'400.0))
          ->type_name("TIME");
  command
      ->add_option(
          "--max-age", options->max_age_s,
          "With --grid: leave values empty between readings that are further apart (default: the device's limit)")
      ->transform(CLI::AsNumberWithUnit(units))
      ->check(CLI::Range(1e-6, 3'600.0))
      ->needs(grid)
      ->type_name("TIME");
  command->footer(
      "examples:\n"
      "  axlecast log convert press3.log --to csv --channel '^POSITION/axis1$' -o axis1.csv\n"
      "  axlecast log convert press3.log --to csv --channel ^POSITION/ --grid 10ms -o grid.csv\n"
      "  axlecast log convert press3.log --to mcap -o press3.mcap\n"
      "  axlecast log convert press3.log --to candump -o - | log2asc can0\n"
      "  axlecast log convert press3.log --to pcap --channel '^WIRE/rs485-0$' -o rs485-0.pcap\n"
      "docs/convert.md describes each format. Exit code 0: complete; 3: written, but the log is damaged; 1: "
      "nothing is\n"
      "written; 2: usage.");
  command->callback([options, &exit_code] { exit_code = RunLogConvert(*options); });
}

void AddLogPlotCommand(CLI::App& log, int& exit_code) {
  auto options = std::make_shared<LogPlotOptions>();
  CLI::App* command = log.add_subcommand("plot", "Plot fields of messages over time, as SVG or PNG");
  options->log.AddTo(*command);
  command->add_option("--field", options->fields, "Plot this number: CHANNEL:NAME, as in JSON; may be repeated")
      ->required()
      ->take_all()
      ->type_name("FIELD");
  options->output.AddTo(*command);
  command->add_option("--title", options->title, "Title of the picture (default: the name of the log)");
  command->footer(
      "examples:\n"
      "  axlecast log plot press3.log --field POSITION/axis1:value -o axis1.svg\n"
      "  axlecast log plot press3.log --field POSITION/axis1:value --field POSITION/axis1:speed_rad_s -o "
      "axis1.png\n"
      "  axlecast log plot press3.log --field MOTOR/gm1:current_a --field 'MOTOR/gm1:accel_mps2[0]' -o gm1.svg\n"
      "Curves of one unit share a panel. A gap in the readings is a gap in the curve.\n"
      "Exit code 0: complete; 3: drawn, but the log is damaged; 1: nothing is drawn; 2: usage;\n"
      "4: the output cannot be written.");
  command->callback([options, &exit_code] { exit_code = RunLogPlot(*options); });
}

}  // namespace axlecast
