#include "tools/axlecast/command_run.h"

#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <iostream>
#include <optional>

#include "drivers/io/system_clock.h"
#include "tools/axlecast/columns.h"
#include "tools/axlecast/command_client.h"
#include "tools/axlecast/do_request.h"
#include "tools/axlecast/exit_code.h"
#include "tools/axlecast/live_machine.h"
#include "tools/axlecast/screen.h"
#include "tools/axlecast/status_text.h"
#include "tools/axlecast/table.h"
#include "tools/json/field.h"

namespace axlecast {
namespace {

constexpr MonoNs kPresentValueWait = 1500 * kMillisecond;
constexpr std::int64_t kWaitMs = 60'000;  // the longest operation reads or writes a whole EEPROM

// While it lives the first SIGINT or SIGTERM asks for cancellation; the second ends the program.
class CancelOnSignal {
 public:
  CancelOnSignal() {
    requested_ = false;
    struct sigaction action {};
    action.sa_handler = [](int) { requested_ = true; };
    action.sa_flags = static_cast<int>(SA_RESETHAND);
    sigaction(SIGINT, &action, &interrupt_);
    sigaction(SIGTERM, &action, &terminate_);
  }
  ~CancelOnSignal() {
    sigaction(SIGINT, &interrupt_, nullptr);
    sigaction(SIGTERM, &terminate_, nullptr);
  }
  CancelOnSignal(const CancelOnSignal&) = delete;
  CancelOnSignal& operator=(const CancelOnSignal&) = delete;

  [[nodiscard]] static const std::atomic<bool>& requested() { return requested_; }

 private:
  static inline std::atomic<bool> requested_ = false;
  struct sigaction interrupt_ {};
  struct sigaction terminate_ {};
};

// What the device says now, so that the operator sees what would be lost.
std::string PresentText(const DeviceView& device, MonoNs now) {
  if (!device.valid) return device.name + ": present position not known, no valid POSITION came";
  std::string text = device.name + " is at " + ValueText(device) + " (" + Decimal(device.Turns(), 4) + " turns, " +
                     Decimal(device.SpeedRpm(), 1) + " rpm), ";
  text += device.Online(now) ? "ONLINE" : "not ONLINE";
  const std::string alarms = AlarmText(device, 60);
  return alarms.empty() ? text : text + ", alarms: " + alarms;
}

// Shows the present value and asks. The exit code when it shall not be done. Binds the command to the epoch shown.
std::optional<int> Ask(const MachineConfig& machine, const OperationSpec& operation, const CommandWish& wish,
                       CommandRequest& request) {
  if (isatty(STDIN_FILENO) != 1) {
    std::cerr << operation.name << " is destructive and asks first, but standard input is no terminal: add --yes\n";
    return kExitUsage;
  }
  const SystemClock clock;
  LiveMachine live(machine, clock);
  const auto known = [&wish](const MachineView& view) {
    const DeviceView& device = *view.FindDevice(wish.device);
    return device.valid && device.info;
  };
  if (!live.problem().empty() || !live.Gather(clock.Now() + kPresentValueWait, known)) {
    std::cerr << (live.problem().empty() ? "the LCM port failed" : live.problem()) << '\n';
    return kExitBad;
  }
  const DeviceView& device = *live.view().FindDevice(wish.device);
  std::cerr << PresentText(device, clock.Now()) << '\n'
            << operation.name << ": " << operation.help << "\nDo it? [y/N] ";
  std::string answer;
  std::getline(std::cin, answer);
  if (answer != "y" && answer != "Y" && answer != "yes") {
    std::cerr << "nothing was done\n";
    return kExitRejected;
  }
  if (request.expect_epoch < 0 && device.valid) request.expect_epoch = device.valid->datum_epoch;
  return std::nullopt;
}

// What a read brought, one "key: value" a line. False when the file cannot be written.
bool WriteChanges(const std::string& file, const CommandResult& result) {
  std::ofstream out(file);
  out << "# axlecast " << result.status.operation << " of " << result.status.device << ", command "
      << HexText(result.id) << ", utime " << result.status.finished_utime << '\n';
  for (const change_t& change : result.status.changes) out << change.key << ": " << change.after << '\n';
  out.close();
  return out.good();
}

int Tell(const CommandResult& result, const CommandWish& wish) {
  static_cast<void>(WriteOut(wish.json ? JsonLine(ToJson(result)) + '\n' : ToText(result)));
  const int exit_code = ExitCode(result);
  if (wish.out.empty() || (exit_code != kExitDone && exit_code != kExitUnverifiable)) return exit_code;
  if (WriteChanges(wish.out, result)) return exit_code;
  std::cerr << "cannot write " << wish.out << '\n';
  return kExitBad;
}

// Runs `act` with a client on the machine's command port.
template <typename Act>
int WithClient(const MachineConfig& machine, const CommandWish& wish, const Act& act) {
  LcmPort port(machine.lcm.command_url, machine.lcm.prefix);
  if (!port.problem().empty()) {
    std::cerr << port.problem() << '\n';
    return kExitBad;
  }
  const SystemClock clock;
  CommandClient client(port, clock);
  const CancelOnSignal cancel;
  CommandClient::Options options;
  options.wait_ms = kWaitMs + wish.valid_ms;
  options.cancel = &CancelOnSignal::requested();
  if (!wish.json) {
    options.on_status = [](const command_status_t& status) {
      if (status.is_final != 0 || status.text.empty()) return;
      std::cerr << Right(Decimal(100.0 * status.progress, 0), 3) << " % " << Printable(status.text) << '\n';
    };
  }
  return Tell(act(client, options), wish);
}

}  // namespace

int RunCommand(const MachineConfig& machine, const CommandWish& wish) {
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
  if (found.operation->destructive && !wish.yes) {
    if (const auto refused = Ask(machine, *found.operation, wish, request)) return *refused;
  }
  return WithClient(machine, wish, [&request](CommandClient& client, const CommandClient::Options& options) {
    return client.Execute(request, options);
  });
}

int RunQuery(const MachineConfig& machine, const CommandId& id, bool json) {
  CommandWish wish;
  wish.json = json;
  return WithClient(machine, wish, [&id](CommandClient& client, const CommandClient::Options& options) {
    return client.Query(id, options);
  });
}

}  // namespace axlecast
