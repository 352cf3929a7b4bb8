#include "tools/axlecast/command/command_run.h"

#include <iostream>
#include <optional>

#include "core/command/command_id.h"
#include "core/messages/json/field.h"
#include "platform/os/new_file.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/command/command_report.h"
#include "tools/axlecast/command/do_request.h"
#include "tools/axlecast/command/memory_cells.h"
#include "tools/axlecast/command/operator_client.h"
#include "tools/axlecast/common/confirmation.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/screen.h"
#include "tools/axlecast/live/status_text.h"
#include "tools/monitor/live_machine.h"

namespace axlecast {
namespace {

// On a full bus a monitor is read every few seconds.
MonoNs PresentValueWait(const Family& family) { return family.has_position ? 1500 * kMillisecond : 6 * kSecond; }

// Shows the present value and asks. The exit code when it shall not be done. Binds the command to the epoch shown.
std::optional<int> Ask(const MachineConfig& machine, const FoundOperation& found, const CommandOptions& wish,
                       CommandRequest& request) {
  const OperationSpec& operation = *found.operation;
  if (!CanAsk(operation.name)) return kExitUsage;
  const SystemClock clock;
  LiveMachine live(machine, clock);
  const auto known = [&wish](const MachineView& view) {
    const DeviceView& device = *view.FindDevice(wish.device);
    return (device.valid || device.motor) && device.info;
  };
  if (!live.problem().empty() || !live.Gather(clock.Now() + PresentValueWait(*found.bus->family), known)) {
    std::cerr << (live.problem().empty() ? "the LCM port failed" : live.problem()) << '\n';
    return kExitBad;
  }
  const DeviceView& device = *live.view().FindDevice(wish.device);
  std::cerr << PresentText(device, clock.Now()) << '\n' << operation.name << ": " << operation.help << '\n';
  if (!Confirmed()) return kExitRejected;
  if (request.expect_epoch < 0 && device.valid) request.expect_epoch = device.valid->datum_epoch;
  return std::nullopt;
}

int Tell(const CommandResult& result, const CommandOptions& wish) {
  static_cast<void>(WriteOut(wish.json ? JsonLine(ToJson(result)) + '\n' : ToText(result)));
  const int exit_code = ExitCode(result);
  if (wish.out.empty() || (exit_code != kExitDone && exit_code != kExitUnverifiable)) return exit_code;
  const std::string problem = WriteOutput(wish.out, MemoryFileText(result));
  if (problem.empty()) return exit_code;
  std::cerr << problem << '\n';
  return kExitBad;
}

int Unreachable(const OperatorClient& client) {
  std::cerr << client.problem() << '\n';
  return kExitBad;
}

}  // namespace

int RunCommand(const MachineConfig& machine, const CommandOptions& wish) {
  const FoundOperation found = FindOperation(machine, wish.device, wish.operation);
  CommandRequest request;
  std::string problem = found.problem;
  if (problem.empty()) problem = SetArguments(*found.operation, wish.words, request);
  if (!problem.empty()) {
    std::cerr << problem << '\n';
    return kExitUsage;
  }
  request.device = wish.device;
  request.operation = wish.operation;
  request.valid_ms = wish.valid_ms;
  request.expect_epoch = wish.epoch;
  request.reason = wish.reason;
  request.prepare = wish.prepare;
  if (!wish.commit.empty()) request.token = ParseId(wish.commit);
  const bool sure = wish.yes || wish.prepare || request.token;
  if ((found.operation->destructive || wish.asks) && !sure) {
    if (const auto refused = Ask(machine, found, wish, request)) return *refused;
  }
  OperatorClient client(machine, wish.key, !wish.json);
  if (!client.problem().empty()) return Unreachable(client);
  return Tell(client.Execute(request), wish);
}

int RunQuery(const MachineConfig& machine, const CommandId& id, bool json) {
  CommandOptions wish;
  wish.json = json;
  OperatorClient client(machine, "", !json);
  if (!client.problem().empty()) return Unreachable(client);
  return Tell(client.Query(id), wish);
}

}  // namespace axlecast
