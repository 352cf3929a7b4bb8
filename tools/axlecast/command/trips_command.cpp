#include "core/base/result.h"
#include "tools/axlecast/command/subcommands.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <map>
#include <memory>

#include "core/messages/json/field.h"
#include "core/messages/json/message_json.h"
#include "core/messages/message.h"
#include "platform/net/lcm_port.h"
#include "platform/os/new_file.h"
#include "tools/axlecast/command/command_request.h"
#include "tools/axlecast/command/command_run.h"
#include "tools/axlecast/command/format_trip.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/terminal.h"

namespace axlecast {
namespace {

constexpr int kQuietMs = 300;  // TRIP and COMMAND_STATUS arrive on two ports

struct Options {
  ConfigOption config;
  CommandOptions command;
  std::string svg;
};

// Keeps the newest trip log of each index.
class TripCollector {
 public:
  void On(Bytes message) {
    const auto trip = DecodeMessage<trip_log_t>(message);
    if (trip) newest_[trip->log_index] = *trip;
    ++received_;
  }
  [[nodiscard]] int received() const { return received_; }
  [[nodiscard]] std::vector<trip_log_t> NewestFirst() const {
    std::vector<trip_log_t> trips;
    for (const auto& [index, trip] : newest_) trips.push_back(trip);
    return trips;
  }

 private:
  std::map<std::int8_t, trip_log_t> newest_;
  int received_ = 0;
};

// Receives until no trip arrives for kQuietMs. Returns false if the port failed.
bool Drain(LcmPort& port, const TripCollector& trips) {
  for (int before = -1; before != trips.received();) {
    before = trips.received();
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
  const std::string problem = ErrorText(WriteOutput(options.svg, *picture));
  return problem.empty() ? exit_code : Fail(problem, kExitBad);
}

int Run(const Options& options) {
  const auto machine = options.config.Load();
  if (!machine) return options.config.Fail(machine.error());
  CommandRequest request{.device = options.command.device,
                         .operation = "fetch_trip_logs",
                         .valid_ms = options.command.valid_ms,
                         .expect_epoch = options.command.epoch,
                         .reason = options.command.reason};
  if (const auto found = FindOperation(*machine, request.device, request.operation); !found) {
    return Fail(found.error().text, kExitUsage);
  }
  TripCollector trips;
  LcmPort port(machine->lcm.url, machine->lcm.prefix);
  if (port.problem().empty()) {
    static_cast<void>(port.Subscribe("TRIP/" + request.device,
                                     [&trips](const std::string&, Bytes message) { trips.On(message); }));
  }
  OperatorClient client(*machine, options.command.key, !options.command.json);
  if (!port.problem().empty() || !client.problem().empty()) {
    return Fail(port.problem().empty() ? client.problem() : port.problem(), kExitBad);
  }
  const CommandResult result = client.Execute(request);
  if (Drain(port, trips)) return Report(options, result, trips.NewestFirst());
  return Fail("the LCM port failed: " + machine->lcm.url, kExitBad);
}

}  // namespace

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
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace axlecast
