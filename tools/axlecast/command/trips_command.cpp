#include "tools/axlecast/command/trips_command.h"
#include "tools/axlecast/common/subcommands.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iostream>
#include <iterator>
#include <limits>
#include <map>
#include <memory>

#include "core/base/text.h"
#include "core/base/utc_text.h"
#include "core/messages/enum_names.h"
#include "core/messages/json/field.h"
#include "core/messages/json/message_json.h"
#include "core/messages/message.h"
#include "platform/net/lcm_port.h"
#include "platform/os/new_file.h"
#include "tools/axlecast/command/command_run.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/convert/chart.h"

namespace axlecast {
namespace {

// The seven curves of a trip log, in the order of trip_log_t.samples.
struct TripQuantity {
  std::string_view name;
  std::string_view unit;
  int decimals;
};
constexpr TripQuantity kTripQuantities[] = {
    {"voltage", "V", 1},           {"current", "A", 3},           {"power", "W", 1},
    {"temperature", "degC", 1},    {"acceleration x", "m/s2", 2}, {"acceleration y", "m/s2", 2},
    {"acceleration z", "m/s2", 2},
};
constexpr std::size_t kTripSamples = 20;

// Returns NaN if the sample was not read.
double TripSample(const trip_log_t& trip, std::size_t quantity, std::size_t sample) {
  if ((static_cast<unsigned>(trip.valid_mask) >> quantity & 1U) == 0) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  return static_cast<double>(trip.samples[quantity][sample]);
}

// Returns the time relative to the trip in s, at most 0. If the interval is unknown, the unit is samples.
double TripTime(const trip_log_t& trip, std::size_t sample) {
  const double samples = static_cast<double>(sample) - static_cast<double>(kTripSamples - 1);
  return trip.interval_us > 0 ? samples * trip.interval_us / 1e6 : samples;
}

// "trip 5, power upper A"
std::string TripTitle(const trip_log_t& trip) {
  const std::string factors = MotorStatusNames(trip.factor_bits);
  return (trip.trip_count > 0 ? "trip " + std::to_string(trip.trip_count) : "a trip") + ", " +
         (factors.empty() ? "cause unknown" : factors);
}

std::string TimeText(std::int64_t unix_us) { return UtcText(unix_us) + " UTC"; }

std::string StartText(const trip_log_t& trip) {
  if (trip.not_before_utime == 0 && trip.not_after_utime == 0) return "at an unknown time";
  if (trip.not_before_utime == 0) return "before " + TimeText(trip.not_after_utime);
  if (trip.not_after_utime == 0) return "after " + TimeText(trip.not_before_utime);
  return "between " + TimeText(trip.not_before_utime) + " and " + TimeText(trip.not_after_utime);
}

std::string Heading(bool in_seconds) {
  std::string text = Right(in_seconds ? "s" : "sample", 7);
  for (const char* column : {"V", "A", "W", "degC", "x m/s2", "y m/s2", "z m/s2"}) text += ' ' + Right(column, 8);
  return text + '\n';
}

std::string SampleRow(const trip_log_t& trip, std::size_t sample) {
  std::string text = Right(Decimal(TripTime(trip, sample), trip.interval_us > 0 ? 1 : 0), 7);
  for (std::size_t quantity = 0; quantity < std::size(kTripQuantities); ++quantity) {
    text += ' ' + Right(Decimal(TripSample(trip, quantity, sample), kTripQuantities[quantity].decimals), 8);
  }
  return text + (sample + 1 == kTripSamples ? "  trip\n" : "\n");
}

// px
constexpr double kWidth = 720;
constexpr double kLeft = 80;
constexpr double kRight = 700;
constexpr double kPlotHeight = 90;
constexpr double kPanelHeight = 150;
constexpr double kLegendRow = 20;

// Returns an axis around all samples of a quantity. It has no ticks if none was read.
RoundAxis AxisOf(const std::vector<trip_log_t>& trips, std::size_t quantity) {
  constexpr int kTicks = 3;
  double low = INFINITY;
  double high = -INFINITY;
  for (const trip_log_t& trip : trips) {
    for (std::size_t sample = 0; sample < kTripSamples; ++sample) {
      const double value = TripSample(trip, quantity, sample);
      if (!std::isfinite(value)) continue;
      low = std::min(low, value);
      high = std::max(high, value);
    }
  }
  return MakeRoundAxis(low, high, kTicks);
}

std::vector<Tick> TimeTicks(double first_s) {
  constexpr int kTicks = 5;
  std::vector<Tick> ticks = MakeRoundAxis(first_s, 0, kTicks).ticks;
  std::erase_if(ticks, [first_s](const Tick& tick) { return tick.at < first_s * (1 + 1e-9); });
  return ticks;
}

Canvas::CurveStyle Style(std::size_t trip) { return {.number = trip, .dashed = true}; }

// Draws the samples that were read, and a circle at the trip.
void DrawTrip(Canvas& canvas, const ChartPanel& panel, const trip_log_t& trip, std::size_t quantity,
              std::size_t index) {
  std::vector<Canvas::Polyline> polylines;
  bool drawing = false;
  for (std::size_t sample = 0; sample < kTripSamples; ++sample) {
    const double value = TripSample(trip, quantity, sample);
    if (std::isfinite(value)) {
      if (!drawing) polylines.emplace_back();
      polylines.back().push_back(panel.At(TripTime(trip, sample), value));
    }
    drawing = std::isfinite(value);
  }
  if (polylines.empty()) return;
  canvas.DrawCurve(polylines, Style(index));
  if (drawing) canvas.DrawCircle(polylines.back().back(), Style(index));
}

void DrawLegend(Canvas& canvas, const std::vector<trip_log_t>& trips) {
  for (std::size_t i = 0; i < trips.size(); ++i) {
    const double y = 30 + kLegendRow * static_cast<double>(i + 1);
    canvas.DrawLegendLine({kLeft, y - 4}, {kLeft + 30, y - 4}, Style(i));
    canvas.DrawText({kLeft + 40, y}, TripTitle(trips[i]) + (i == 0 ? " (newest)" : ""), {});
  }
}

constexpr int kQuietMs = 300;  // TRIP and COMMAND_STATUS arrive on two ports

struct Options {
  ConfigOption config;
  CommandOptions command;
  std::string svg;
};

// The newest trip log of each index, and the number of received logs.
struct TripLogs {
  std::map<std::int8_t, trip_log_t> newest;
  int received = 0;
};

// Receives until no trip arrives for kQuietMs. Returns false if the port failed.
bool Drain(LcmPort& port, const TripLogs& logs) {
  for (int before = -1; before != logs.received;) {
    before = logs.received;
    if (!port.Handle(kQuietMs)) return false;
  }
  return true;
}

int Report(const Options& options, const CommandResult& result, const std::vector<trip_log_t>& trips) {
  if (options.command.json) {
    nlohmann::ordered_json json = ToJson(result);
    json["trips"] = nlohmann::ordered_json::array();
    for (const trip_log_t& trip : trips) json["trips"].push_back(ToJson(trip));
    static_cast<void>(WriteOut(JsonLine(json) + '\n'));
  } else {
    static_cast<void>(WriteOut(trips.empty() ? ToText(result) : TripTable(options.command.device, trips)));
  }
  const int exit_code = ExitCode(result);
  if (exit_code != kExitDone && !trips.empty() && !options.command.json) std::cerr << ToText(result);
  if (options.svg.empty() || exit_code != kExitDone) return exit_code;
  const auto picture = TripSvg(options.command.device, trips);
  if (!picture) return Fail(picture.error().text, kExitBad);
  const auto written = WriteOutput(options.svg, *picture);
  return written ? exit_code : Fail(written.error().text, kExitBad);
}

int Run(const MachineConfig& machine, const Options& options) {
  CommandRequest request{.device = options.command.device,
                         .operation = "fetch_trip_logs",
                         .valid_ms = options.command.valid_ms,
                         .expect_epoch = options.command.epoch,
                         .reason = options.command.reason};
  if (const auto found = FindOperation(machine, request.device, request.operation); !found) {
    return Fail(found.error().text, kExitUsage);
  }
  TripLogs logs;
  LcmPort port(machine.lcm.url, machine.lcm.prefix, machine.machine);
  if (port.problem().empty()) {
    static_cast<void>(port.Subscribe("TRIP/" + request.device, [&logs](const std::string&, Bytes message) {
      if (const auto trip = DecodeMessage<trip_log_t>(message)) logs.newest[trip->log_index] = *trip;
      ++logs.received;
    }));
  }
  OperatorClient client(machine, options.command.key, !options.command.json);
  if (!port.problem().empty()) return Fail(port.problem(), kExitBad);
  if (const auto ready = client.state(); !ready) return Fail(ready.error().text, kExitBad);
  const CommandResult result = client.Execute(request);
  if (!Drain(port, logs)) return Fail("the LCM port failed: " + machine.lcm.url, kExitBad);
  std::vector<trip_log_t> trips;  // newest first, as their indexes
  for (const auto& [index, trip] : logs.newest) trips.push_back(trip);
  return Report(options, result, trips);
}

}  // namespace

std::string TripTable(const std::string& device, const std::vector<trip_log_t>& trips) {
  std::string text;
  for (const trip_log_t& trip : trips) {
    text += (text.empty() ? "" : "\n") + device + ": " + TripTitle(trip) + ", " + StartText(trip) + '\n' +
            Heading(trip.interval_us > 0);
    for (std::size_t sample = 0; sample < kTripSamples; ++sample) text += SampleRow(trip, sample);
  }
  return text;
}

Result<std::string> TripSvg(const std::string& device, const std::vector<trip_log_t>& trips) {
  double first_s = 0;
  for (const trip_log_t& trip : trips) first_s = std::min(first_s, TripTime(trip, 0));
  const double head = 70 + kLegendRow * static_cast<double>(trips.size());
  const double height = head + kPanelHeight * static_cast<double>(std::size(kTripQuantities));
  const auto canvas = MakeSvgCanvas({kWidth, height}, device + ": trips");
  canvas->DrawText({kLeft, 26}, device + ": what was before each trip; circles mark the trip", {.bold = true});
  DrawLegend(*canvas, trips);
  if (trips.empty()) {
    canvas->DrawText({kLeft, 50}, "no trip is recorded", {});
    return canvas->Finish();
  }
  const bool in_seconds = std::ranges::all_of(trips, [](const auto& t) { return t.interval_us > 0; });
  const std::string time_title = std::string("time before the trip, ") + (in_seconds ? "s" : "samples");
  for (std::size_t i = 0; i < std::size(kTripQuantities); ++i) {
    const TripQuantity& quantity = kTripQuantities[i];
    const double top = head + kPanelHeight * static_cast<double>(i);
    const ChartPanel panel{.left = kLeft,
                           .right = kRight,
                           .top = top,
                           .bottom = top + kPlotHeight,
                           .first_x = first_s,
                           .last_x = 0,
                           .values = AxisOf(trips, i)};
    canvas->DrawText({kLeft, top - 8}, std::string(quantity.name) + ", " + std::string(quantity.unit),
                     {.bold = true});
    DrawAxes(*canvas, panel, TimeTicks(first_s), time_title);
    canvas->DrawLine({kRight, top}, {kRight, panel.bottom}, Canvas::Stroke::kDashed);
    if (panel.values.ticks.empty()) canvas->DrawText({kLeft + 10, top + kPlotHeight / 2}, "not read", {});
    for (std::size_t trip = 0; trip < trips.size(); ++trip) DrawTrip(*canvas, panel, trips[trip], i, trip);
  }
  return canvas->Finish();
}

void AddTripsCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("trips", "Fetch the logs of a motor's last trips");
  command->add_option("DEVICE", options->command.device, "The motor's monitor")->required();
  command->add_option("--svg", options->svg, "Write a picture with the seven curves of each trip to this file")
      ->type_name("FILE");
  AddCommandOptions(*command, options->config, options->command, false);
  command->footer(std::string("examples:\n"
                              "  axlecast trips gm3\n"
                              "  axlecast trips gm3 --svg gm3.svg\n"
                              "  axlecast trips gm3 --json | jq '.trips[0].samples[1]'\n") +
                  kCommandExitCodes);
  RunOnMachine<Options>(*command, options, exit_code, &Run);
}

}  // namespace axlecast
