#include "core/base/result.h"
#include "tools/axlecast/common/subcommands.h"

#include <CLI/CLI.hpp>
#include <axlecast/time_quality_t.hpp>
#include <iostream>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/axlecast/permit_issuer.h"
#include "client/axlecast/time_base.h"
#include "client/command/signed_messages.h"
#include "core/command/keys.h"
#include "core/messages/message.h"
#include "core/messages/origin.h"
#include "platform/net/lcm_port.h"
#include "platform/os/process.h"
#include "platform/os/secret_file.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/command/command_run.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/terminal.h"

namespace axlecast {
namespace {

constexpr int kRefreshMs = 100;
constexpr std::int32_t kValidMs = 400;  // up to three may be lost

struct Options {
  ConfigOption config;
  std::string device;
  std::vector<std::string> operations;
  double seconds = std::numeric_limits<double>::infinity();
  std::string key;
};

// Fails if drivers refuse a permit that is signed with the key of `settings`.
Result<> CheckKey(const MachineConfig& machine, const ClientSettings& settings) {
  SecretFiles secrets;
  const Result<ClientKeys> keys = LoadClientKeys(settings, secrets);
  if (!keys) return Failure(keys.error());
  if (machine.bridge.allow_unsigned) return {};
  if (!keys->own) {
    return Failure(
        "no key of role control can be read here: name one with --key FILE, or with file: under bridge: keys: of " +
        machine.file);
  }
  const KeyGrant* grant = machine.bridge.FindKey(KeyId(keys->own->public_key()));
  if (grant == nullptr) return Failure("the key is not listed under bridge: keys: of " + machine.file);
  if (grant->role == Role::kControl) return {};
  return Failure("the key " + grant->name + " has role " + std::string(RoleName(grant->role)) +
                 ": permits need a key of role control");
}

// Receives the claims about the machine's time base, if it has one.
class BaseReception {
 public:
  explicit BaseReception(const MachineConfig& machine) : time_(NameHash(machine.machine)) {
    if (!machine.time.root.empty()) port_.emplace(machine.lcm.url, machine.lcm.prefix, machine.machine);
  }

  [[nodiscard]] Result<> Open() {
    if (!port_) return {};
    const bool subscribed = port_->Subscribe("TIME/.*", [this](const std::string&, Bytes message) {
      if (const auto time = DecodeMessage<time_quality_t>(message)) time_.OnTime(*time, clock_.Now());
    });
    return subscribed ? Result<>() : Failure(port_->problem());
  }
  // Takes what has arrived. Returns false if nothing can be received any more.
  [[nodiscard]] bool Take() { return !port_ || port_->Handle(0); }
  [[nodiscard]] const TimeBase& time() const { return time_; }

 private:
  const SystemClock clock_{};
  std::optional<LcmPort> port_;
  TimeBase time_;
};

int Issue(PermitIssuer& issuer, BaseReception& base, const Options& options) {
  const SystemClock clock;
  const StopSignal stop;
  const MonoNs start = clock.Now();
  std::cerr << "permits for " << options.device << " are being sent; Ctrl-C ends them\n";
  while (static_cast<double>(clock.Now() - start) * 1e-9 < options.seconds) {
    if (!base.Take()) return Fail("no message of the time base can be received any more", kExitBad);
    if (!issuer.Allow(options.device, options.operations, kValidMs))
      return Fail(ErrorText(issuer.state()), kExitBad);
    if (stop.Wait(kRefreshMs)) break;
    if (issuer.totals().failed > 0) return Fail("a permit was not sent: this host refused its message", kExitBad);
  }
  return issuer.Withdraw(options.device) ? kExitDone : kExitBad;
}

int Permit(const MachineConfig& machine, const Options& options) {
  for (const std::string& operation : options.operations) {
    const auto found = FindOperation(machine, options.device, operation);
    if (!found) return Fail(found.error().text, kExitUsage);
  }
  const ClientSettings settings = OperatorSettings(machine, options.key, Role::kControl);
  if (const auto usable = CheckKey(machine, settings); !usable) return Fail(usable.error().text, kExitBad);
  BaseReception base(machine);
  if (const Result<> open = base.Open(); !open) return Fail(open.error().text, kExitBad);
  PermitIssuer issuer(settings, {.time = &base.time()});
  if (const Result<> usable = issuer.state(); !usable) return Fail(usable.error().text, kExitBad);
  return Issue(issuer, base, options);
}

}  // namespace

void AddPermitCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command =
      app.add_subcommand("permit", "Permit operations of a device while this runs, instead of a control process");
  command->add_option("DEVICE", options->device, "The device")->required();
  command->add_option("OPERATIONS", options->operations, "Operations to permit")
      ->required()
      ->expected(1, static_cast<int>(PermitIssuer::kMaxOperations))
      ->type_name("OPERATION");
  command->add_option("--for", options->seconds, "Duration: 5s, 500ms, 2min; default until Ctrl-C")
      ->transform(CLI::AsNumberWithUnit(std::map<std::string, double>{{"ms", 1e-3}, {"s", 1}, {"min", 60}}))
      ->check(CLI::PositiveNumber)
      ->type_name("TIME");
  options->config.AddTo(*command, ConfigOption::Form::kOptionOnly);
  AddKeyOption(*command, options->key);
  command->footer(
      "example: axlecast permit axis1 zero_single_turn --for 5s\n"
      "Only for commissioning: make sure that the axis is at rest and its drive off. Needs a key of role\n"
      "control, unless the machine's file allows unsigned commands.\n"
      "exit code: 0 permits were sent until the end, 1 no usable key or port, 2 usage");
  RunOnMachine<Options>(*command, options, exit_code, &Permit);
}

}  // namespace axlecast
