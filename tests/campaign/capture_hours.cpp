// Writes a log as a machine with one captured T-format bus at 1 kHz would leave it after some hours: a whole driver on
// its simulator, in virtual time. For `axlecast redecode --diff`, which must find nothing that differs.
//
//   capture_hours FILE SECONDS

#include <cstdlib>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include "core/config/load.h"
#include "tests/conformance/example_link.h"
#include "tests/support/counting_family.h"
#include "tests/support/fixed_secrets.h"
#include "tools/log/log_event.h"

namespace axlecast {
namespace {

constexpr std::string_view kMachine = R"(
machine: capture
buses:
  rs485-0:
    family: tformat
    simulate: {axis1: {speed_rpm: 60}}
    capture: true
    poll_hz: 1000
    devices:
      axis1: {model: ts5669n127, unit: mm, per_turn: 5.0, datum: {counts: 1000}, permit: not_required}
)";

class LogSink final : public MessageSink {
 public:
  LogSink(const std::string& file, const Clock& clock) : file_(file, std::ios::binary), clock_(clock) {}

  void Publish(const std::string& channel, Bytes message) override {
    record_.clear();
    AppendEvent(record_, {number_++, clock_.UtcMicroseconds(), channel, message});
    file_.write(reinterpret_cast<const char*>(record_.data()), static_cast<std::streamsize>(record_.size()));
  }
  [[nodiscard]] bool Close() {
    file_.close();
    return file_.good();
  }

 private:
  std::ofstream file_;
  const Clock& clock_;
  std::vector<std::uint8_t> record_;
  std::int64_t number_ = 0;
};

class NoSink final : public MessageSink {
 public:
  void Publish(const std::string& /*channel*/, Bytes /*message*/) override {}
};

int Run(const std::string& file, MonoNs time) {
  ConfigErrors errors("capture");
  const auto machine = ParseConfig(std::string(kMachine), errors);
  const auto simulator = machine ? MakeSimulator(*machine, machine->buses[0], errors) : nullptr;
  if (!simulator) {
    std::cerr << errors.Text();
    return 1;
  }
  const BusConfig& bus = machine->buses[0];
  FakeClock clock;
  LogSink log(file, clock);
  log.Publish(std::string(kMachineChannel),
              Bytes(reinterpret_cast<const std::uint8_t*>(kMachine.data()), kMachine.size()));
  NoSink commands;
  FixedSecrets secrets;
  ExampleLink link(bus, clock, *simulator);
  DriverPorts ports{.secrets = &secrets,
                    .clock = &clock,
                    .data = &log,
                    .commands = &commands,
                    .log = [](LogLevel, std::string_view) {},
                    .link_warnings = {}};
  link.PlugInto(ports);
  Driver driver(bus, UnsignedBridge(), Origin{.boot_id = 42}, std::move(ports));
  for (const MonoNs end = clock.Now() + time; clock.Now() < end;) driver.RunOnce();
  driver.Stop();
  return log.Close() ? 0 : 1;
}

}  // namespace
}  // namespace axlecast

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "capture_hours FILE SECONDS\n";
    return 2;
  }
  return axlecast::Run(argv[1], std::atoll(argv[2]) * axlecast::kSecond);
}
