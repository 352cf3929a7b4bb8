#include "tools/axlecast/command/offset_command.h"
#include "tools/axlecast/common/subcommands.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "core/base/text.h"
#include "core/messages/enum_names.h"
#include "core/messages/json/field.h"
#include "core/messages/message.h"
#include "platform/net/lcm_port.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/command/command_run.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/live/format_device.h"

namespace axlecast {
namespace {

double Rpm(const position_t& reading) { return reading.speed_rad_s * 60 / (2 * std::numbers::pi); }

bool Has(const position_t& reading, std::int32_t flag) { return (reading.flags & flag) != 0; }

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

int Capture(const MachineConfig& machine, const Options& options) {
  const BusConfig* bus = machine.BusOf(options.device);
  if (bus == nullptr) return Fail(UnknownDevice(machine, options.device), kExitUsage);
  if (!bus->family->has_position) return Fail(options.device + " has no position", kExitUsage);
  LcmPort port(machine.lcm.url, machine.lcm.prefix, machine.machine);
  if (!port.problem().empty()) return Fail(port.problem(), kExitBad);
  OffsetCapture capture(options.samples);
  if (!Gather(port, options.device, capture)) return Fail("the LCM port failed", kExitBad);
  if (!capture.state()) return Fail(options.device + ": " + capture.state().error().text, kExitRejected);
  if (!capture.done()) {
    return Fail(options.device + ": " + std::to_string(capture.count()) +
                    " valid readings, then none for 10 s: axlecast status shows why" + NetworkNote(port.received()),
                kExitNoAnswer);
  }
  Show(capture.Json(options.device, options.value), capture.Text(options.device, options.value), options.json);
  return kExitDone;
}

}  // namespace

void OffsetCapture::On(const device_info_t& info) {
  if (first_ && info.boot_id != first_->boot_id) return;  // of another start of the driver
  info_ = info;
}

void OffsetCapture::On(const position_t& reading) {
  if (done() || !Has(reading, position_t::FLAG_VALID) || reading.counts_per_turn <= 0) return;
  if (!first_) {
    first_ = reading;
    lowest_ = highest_ = reading.counts;
    if (info_ && info_->boot_id != reading.boot_id) info_.reset();
  }
  state_ = Check(reading);
  if (!state_) return;
  ++count_;
  sum_ += static_cast<double>(reading.counts - first_->counts);
  lowest_ = std::min(lowest_, reading.counts);
  highest_ = std::max(highest_, reading.counts);
}

Result<> OffsetCapture::Check(const position_t& reading) const {
  const double turns = std::abs(static_cast<double>(reading.counts) - static_cast<double>(first_->counts)) /
                       static_cast<double>(reading.counts_per_turn);
  if (Has(reading, position_t::FLAG_SPEED_VALID) && std::abs(Rpm(reading)) > kMaxSpeedRpm) {
    return Failure("it turns, at " + Decimal(Rpm(reading), 2) + " rpm: stop it, then capture again");
  }
  if (reading.boot_id != first_->boot_id) return Failure("its driver was restarted meanwhile: capture again");
  if (reading.datum_epoch != first_->datum_epoch) return Failure("its datum changed meanwhile: capture again");
  if (turns <= kMaxSpreadTurns) return {};
  return Failure("it moved by " + Decimal(turns * 360, 3) + " degrees meanwhile: stop it, then capture again");
}

double OffsetCapture::counts() const {
  return static_cast<double>(first_->counts) + static_cast<double>(info_->datum_counts) +
         sum_ / static_cast<double>(count_);
}

std::int64_t OffsetCapture::Datum(double value) const {
  const double unit_per_count =
      info_->per_turn * static_cast<double>(info_->ratio_num) /
      (static_cast<double>(info_->ratio_den) * static_cast<double>(info_->counts_per_turn));
  return std::llround(counts() - value / unit_per_count);
}

std::string OffsetCapture::Text(const std::string& device, double value) const {
  return device + ": " + std::to_string(count_) + " readings at rest, mean " + Decimal(counts(), 1) +
         " counts, spread " + std::to_string(spread()) + " counts\nin the machine's file, below " + device +
         ", so that it reads " + Decimal(value, 6) + ' ' + std::string(UnitName(info_->unit)) +
         " here:\ndatum: {counts: " + std::to_string(Datum(value)) + "}\n";
}

nlohmann::ordered_json OffsetCapture::Json(const std::string& device, double value) const {
  return {{"device", device},   {"samples", count_}, {"counts", counts()},
          {"spread", spread()}, {"value", value},    {"datum", Datum(value)}};
}

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
  RunOnMachine<Options>(*command, options, exit_code, &Capture);
}

}  // namespace axlecast
