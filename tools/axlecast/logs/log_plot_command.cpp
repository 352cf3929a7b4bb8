#include "tools/axlecast/logs/subcommands.h"

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/logs/conversion_output.h"
#include "tools/axlecast/logs/log_selection.h"
#include "tools/convert/plot.h"

namespace axlecast {
namespace {

struct Options {
  LogSelection log;
  ConversionOutput output;
  std::vector<std::string> fields;
  std::string title;
};

int Wrong(const std::string& problem, int exit_code = kExitUsage) {
  std::cerr << problem << '\n';
  return exit_code;
}

int Run(Options& options) {
  std::vector<PlotField> fields;
  for (const std::string& text : options.fields) {
    const auto field = ParsePlotField(text);
    if (!field) return Wrong("'" + text + "' is no field: write CHANNEL:NAME, like POSITION/axis1:value");
    fields.push_back(*field);
  }
  const std::string ending = std::filesystem::path(options.output.path()).extension();
  if (ending != ".svg" && ending != ".png")
    return Wrong("-o: the name ends in .svg or .png, which says the format");
  if (const std::optional<int> failed = options.log.Open()) return *failed;
  if (const std::optional<int> failed = options.output.Open()) return *failed;
  const Result<PlotData> data = CollectPlot(options.log.events(), fields, kPlotColumns);
  if (!data) return Wrong(options.log.file() + ": " + data.error().text, kExitBad);
  const std::string title =
      options.title.empty() ? std::filesystem::path(options.log.file()).filename().string() : options.title;
  const Result<std::string> picture = ending == ".svg" ? PlotSvg(title, *data) : PlotPng(title, *data);
  if (!picture) return Wrong(picture.error().text, kExitBad);
  static_cast<void>(options.output.Write(*picture));
  return options.output.Keep(options.log);
}

}  // namespace

void AddLogPlotCommand(CLI::App& log, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = log.add_subcommand("plot", "Fields of messages over time, as SVG or PNG");
  options->log.AddTo(*command);
  command->add_option("--field", options->fields, "CHANNEL:NAME of a number, as in JSON; again for another curve")
      ->required()
      ->take_all()
      ->type_name("FIELD");
  options->output.AddTo(*command);
  command->add_option("--title", options->title, "Above the picture; else the log's name");
  command->footer(
      "examples:\n"
      "  axlecast log plot press3.log --field POSITION/axis1:value -o axis1.svg\n"
      "  axlecast log plot press3.log --field POSITION/axis1:value --field POSITION/axis1:speed_rad_s -o "
      "axis1.png\n"
      "  axlecast log plot press3.log --field MOTOR/gm1:current_a --field 'MOTOR/gm1:accel_mps2[0]' -o gm1.svg\n"
      "Curves of one unit share a panel. A gap in the readings is a gap in the curve.\n"
      "Exit code 0: whole; 3: drawn, but the log is damaged; 1: nothing is drawn; 2: usage;\n"
      "4: the output cannot be written.");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace axlecast
