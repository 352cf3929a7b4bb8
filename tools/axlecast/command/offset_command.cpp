#include "tools/axlecast/command/subcommands.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "core/messages/json/field.h"
#include "core/messages/message.h"
#include "platform/net/lcm_port.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/command/command_request.h"
#include "tools/axlecast/command/offset_capture.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/live/format_device.h"

namespace axlecast {
namespace {

constexpr MonoNs kTimeout = 10 * kSecond;  // without a valid reading
constexpr int kWaitMs = 100;

struct Options {
  ConfigOption config;
  std::string device;
  double value = 0;
  std::int64_t samples = 200;
  bool json = false;
};

// Receives readings until the capture is done. Returns false if the port failed.
bool Gather(LcmPort& port, const std::string& device, OffsetCapture& capture) {
  const SystemClock clock;
  const bool subscribed =
      port.Subscribe("(POSITION|DEVICE)/" + device, [&capture](const std::string& channel, Bytes message) {
        if (channel.front() == 'D') {
          if (const auto info = DecodeMessage<device_info_t>(message)) capture.On(*info);
        } else if (const auto reading = DecodeMessage<position_t>(message)) {
          capture.On(*reading);
        }
      });
  MonoNs give_up = clock.Now() + kTimeout;
  std::int64_t seen = 0;
  while (subscribed && !capture.done() && clock.Now() < give_up) {
    if (!port.Handle(kWaitMs)) return false;
    if (capture.count() != seen) give_up = clock.Now() + kTimeout;
    seen = capture.count();
  }
  return subscribed;
}

int Capture(const Options& options) {
  const auto machine = options.config.Load();
  if (!machine) return options.config.Fail(machine.error());
  const BusConfig* bus = machine->BusOf(options.device);
  if (bus == nullptr) return Fail(UnknownDevice(*machine, options.device), kExitUsage);
  if (!bus->family->has_position) return Fail(options.device + " has no position", kExitUsage);
  LcmPort port(machine->lcm.url, machine->lcm.prefix);
  if (!port.problem().empty()) return Fail(port.problem(), kExitBad);
  OffsetCapture capture(options.samples);
  if (!Gather(port, options.device, capture)) return Fail("the LCM port failed", kExitBad);
  if (!capture.problem().empty()) return Fail(options.device + ": " + capture.problem(), kExitRejected);
  if (!capture.done()) {
    return Fail(options.device + ": " + std::to_string(capture.count()) +
                    " valid readings, then none for 10 s: axlecast status shows why",
                kExitNoAnswer);
  }
  static_cast<void>(WriteOut(options.json ? JsonLine(capture.Json(options.device, options.value)) + '\n'
                                          : capture.Text(options.device, options.value)));
  return kExitDone;
}

}  // namespace

void AddOffsetCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* offset = app.add_subcommand("offset", "Determine a fixed datum for the machine's file");
  offset->require_subcommand(1);
  CLI::App* command =
      offset->add_subcommand("capture", "Average readings at rest and print the datum; changes nothing");
  command->add_option("DEVICE", options->device, "The device")->required();
  command->add_option("--value", options->value, "Value of the present position, in the device's unit")
      ->check(PlainNumber())
      ->type_name("V")
      ->capture_default_str();
  command->add_option("--samples", options->samples, "Valid readings to average")
      ->check(CLI::Range(1, 1'000'000))
      ->type_name("N")
      ->capture_default_str();
  options->config.AddTo(*command, ConfigOption::Form::kOptionOnly);
  command->add_flag("--json", options->json, "Print one JSON object");
  command->footer(
      "example: axlecast offset capture axis1 --value 250.0\n"
      "exit code: 0 done, 2 usage, 3 the axis turns or was changed meanwhile, 6 no valid readings");
  command->callback([options, &exit_code] { exit_code = Capture(*options); });
}

}  // namespace axlecast
