#include "tools/axlecast/logs/subcommands.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <iostream>
#include <map>
#include <memory>
#include <string>

#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/logs/conversion_output.h"
#include "tools/axlecast/logs/log_selection.h"
#include "tools/convert/csv.h"
#include "tools/convert/mcap.h"
#include "tools/convert/wire_capture.h"

namespace axlecast {
namespace {

struct Options {
  LogSelection log;
  ConversionOutput output;
  std::string format;
  double grid_s = 0;
  double max_age_s = 0;
};

std::int64_t Microseconds(double seconds) { return std::llround(seconds * 1e6); }

Result<Conversion> Write(Options& options, const Output& out) {
  const EventRange events = options.log.events();
  if (options.format == "mcap") return WriteMcap(events, out);
  if (options.format == "candump") return WriteCandump(events, out);
  if (options.format == "pcap") return WritePcap(events, out);
  if (options.grid_s == 0) return WriteCsvTable(events, out);
  const TimeGrid grid{.period_us = Microseconds(options.grid_s), .max_age_us = Microseconds(options.max_age_s)};
  return WriteCsvGrid(events, options.log.all(), grid, out);
}

int Run(Options& options) {
  if (options.grid_s > 0 && options.format != "csv") {
    std::cerr << "--grid is for --to csv\n";
    return kExitUsage;
  }
  if (const std::optional<int> failed = options.log.Open()) return *failed;
  if (const std::optional<int> failed = options.output.Open()) return *failed;
  const Result<Conversion> done =
      Write(options, [&options](std::string_view part) { return options.output.Write(part); });
  if (!done) {
    std::cerr << options.log.file() << ": " << done.error().text << '\n';
    return kExitBad;
  }
  const int exit_code = options.output.Keep(options.log);
  if (exit_code == kExitFailed) return exit_code;
  const bool rows = options.grid_s > 0;
  std::cerr << done->written << (rows ? " rows" : " messages or frames") << " written";
  if (done->left_out > 0)
    std::cerr << "; " << done->left_out << " events left out: this format cannot contain them";
  std::cerr << '\n';
  if (!done->note.empty()) std::cerr << done->note << '\n';
  return exit_code;
}

}  // namespace

void AddLogConvertCommand(CLI::App& log, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = log.add_subcommand("convert", "A log for other programs: CSV, MCAP, candump, pcap");
  options->log.AddTo(*command);
  command->add_option("--to", options->format, "csv, mcap (Foxglove, PlotJuggler), candump or pcap (Wireshark)")
      ->required()
      ->check(CLI::IsMember({"csv", "mcap", "candump", "pcap"}))
      ->type_name("FORMAT");
  options->output.AddTo(*command);
  const std::map<std::string, double> units = {{"us", 1e-6}, {"ms", 1e-3}, {"s", 1}};
  CLI::Option* grid =
      command
          ->add_option(
              "--grid", options->grid_s,
              "CSV with all positions at the same instants, so far apart (10ms); else messages as they are")
          ->transform(CLI::AsNumberWithUnit(units))
          ->check(CLI::Range(1e-6, 86'400.0))
          ->type_name("TIME");
  command
      ->add_option("--max-age", options->max_age_s,
                   "With --grid: no value between readings further apart; else the device's own limit")
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
      "docs/convert.md says what each holds. Exit code 0: whole; 3: written, but the log is damaged; 1: nothing "
      "is\n"
      "written; 2: usage.");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace axlecast
