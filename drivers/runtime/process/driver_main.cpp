#include "drivers/runtime/process/driver_main.h"

#include <spdlog/spdlog.h>

#include <csignal>
#include <optional>
#include <string>

#include "core/base/result.h"
#include "core/command/keys.h"
#include "drivers/hal/line_guard.h"
#include "drivers/runtime/process/driver.h"
#include "platform/net/lcm_port.h"
#include "platform/os/process.h"
#include "platform/os/secret_file.h"
#include "platform/os/system_clock.h"
#include "platform/os/terminal_log.h"

namespace axlecast {
namespace {

std::shared_ptr<spdlog::logger> MakeLog(const std::string& bus, bool verbose) {
  auto log = std::make_shared<spdlog::logger>(bus, std::make_shared<TerminalLogSink>());
  log->set_pattern("%Y-%m-%dT%H:%M:%S.%eZ %^%l%$ %n: %v", spdlog::pattern_time_type::utc);
  log->set_level(verbose ? spdlog::level::debug : spdlog::level::info);
  log->flush_on(spdlog::level::info);
  return log;
}

spdlog::level::level_enum LevelOf(LogLevel level) {
  if (level == LogLevel::kDebug) return spdlog::level::debug;
  return level == LogLevel::kInfo ? spdlog::level::info : spdlog::level::warn;
}

// Returns the key that signs the answers. Without it, positions are published, but the bridge may not accept the answers.
std::optional<SigningKey> DriverKey(const BridgeConfig& bridge, SecretSource& secrets, spdlog::logger& log) {
  Result<std::optional<SigningKey>> key = LoadKey(bridge.drivers, secrets);
  if (key) return std::move(*key);
  log.warn(
      "{}; the driver runs without its key: positions are published, but the bridge does not accept its answers "
      "and "
      "sends it no commands",
      key.error().text);
  return std::nullopt;
}

constexpr MonoNs kLookPeriod = 100 * kMillisecond;  // between two looks at the state of the network

// Returns the exit code of the process.
int RunLoop(Driver& driver, const BusConfig& bus, const CommandThread& commands, const LcmPort& port,
            const LcmPort& data, const StopSignal& stop, spdlog::logger& log) {
  Supervision supervision;
  ReceptionReport reception;
  MonoNs next_look = 0;
  supervision.Ready();
  while (!stop.Requested() && !commands.failed() && driver.LineTaken().empty()) {
    const MonoNs now = driver.RunOnce();
    supervision.Progress(now);
    if (now < next_look) continue;
    next_look = now + kLookPeriod;
    ReceptionCounts counts = port.received();
    counts += data.received();
    if (reception.Changed(counts)) {
      const std::string lost = reception.NextLine(counts, now, port.warning());
      if (!lost.empty()) log.warn("{}", lost);
    }
  }
  supervision.Stopping();
  if (const std::string taken = driver.LineTaken(); !taken.empty()) {
    const std::string holder = PortHolder(bus.link.port);
    log.error("{}{}; this driver ends and leaves bus {} to it", taken, holder.empty() ? "" : " (" + holder + ")",
              bus.name);
    return 1;
  }
  if (commands.failed()) log.error("the command port delivers no more messages: restart the driver");
  log.info("stopping");
  driver.Stop();
  log.info("stopped");
  return commands.failed() ? 1 : 0;
}

}  // namespace

int RunDriver(const MachineConfig& machine, const BusConfig& bus, bool verbose,
              const DriverInterposers& interposers) {
  const auto log = MakeLog(bus.name, verbose);
  const StopSignal stop;
  static_cast<void>(signal(SIGPIPE, SIG_IGN));  // a closed log must not end the driver
  LcmPort data(machine.lcm.url, machine.lcm.prefix, machine.machine);
  LcmPort commands(machine.lcm.command_url, machine.lcm.prefix, machine.machine);
  for (const LcmPort* port : {&data, &commands}) {
    if (port->problem().empty()) continue;
    log->error("{}", port->problem());
    return 1;
  }

  const SystemClock clock;
  if (HoldsSecrets(bus) || !machine.bridge.drivers.place.empty()) {
    if (const Result<> done = ForbidCoreDumps(); !done) log->warn("{}", done.error().text);
  }
  const Ports ports = MakePorts(machine, bus, clock);
  const auto interposed_link =
      interposers.link && ports.link ? interposers.link(*ports.link) : std::unique_ptr<ByteLink>();
  const auto interposed_port =
      interposers.commands ? interposers.commands(commands) : std::unique_ptr<MessageSink>();
  SecretFiles secrets;
  const std::optional<SigningKey> key = DriverKey(machine.bridge, secrets, *log);
  const Origin origin = NewOrigin(machine.machine);
  log->info("driver of {} ({}) starts, boot id {:016x}", bus.name, bus.family->name, origin.boot_id);
  Driver driver(bus, machine.bridge, origin,
                {.link = interposed_link ? interposed_link.get() : ports.link.get(),
                 .frames = ports.frames.get(),
                 .lines = ports.lines.get(),
                 .secrets = &secrets,
                 .clock = &clock,
                 .data = &data,
                 .commands = interposed_port ? interposed_port.get() : &commands,
                 .has_time_base = !machine.time.root.empty(),
                 .key = key ? &*key : nullptr,
                 .log = [&log](LogLevel level, std::string_view text) { log->log(LevelOf(level), "{}", text); },
                 .link_warnings = ports.warnings});
  log->info("{}", driver.command_server().Rule());
  const CommandThread command_thread(commands, bus, driver);
  // After the command thread has started: it keeps normal scheduling.
  const auto warnings = ApplyRealtime(bus.realtime.priority, bus.realtime.cpu, bus.realtime.lock_memory);
  for (const std::string& warning : warnings) log->warn("{}", warning);
  return RunLoop(driver, bus, command_thread, commands, data, stop, *log);
}

}  // namespace axlecast
