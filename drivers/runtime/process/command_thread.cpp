#include "drivers/runtime/process/command_thread.h"

#include <cassert>

namespace axlecast {
namespace {

constexpr int kWaitMs = 100;

}  // namespace

CommandThread::CommandThread(LcmPort& port, const BusConfig& config, Driver& driver) : port_(port) {
  // Names hold no character that means something in a regular expression.
  [[maybe_unused]] bool heard = port_.Subscribe(
      "DRIVER_COMMAND/" + config.name,
      [&driver](const std::string&, Bytes message) { driver.command_server().OnDriverCommand(message); });
  heard &= port_.Subscribe("DRIVER_STATUS/" + config.name, [&driver](const std::string&, Bytes message) {
    driver.duplicates().OnDriverStatus(message);
  });
  for (const DeviceConfig& device : config.devices) {
    heard &=
        port_.Subscribe("PERMIT/" + device.name, [&driver, name = device.name](const std::string&, Bytes message) {
          driver.command_server().OnPermit(name, message);
        });
  }
  assert(heard);  // the port works, or the driver would not have started
  thread_ = std::thread([this] { Run(); });
}

CommandThread::~CommandThread() {
  ending_ = true;
  thread_.join();
}

void CommandThread::Run() {
  while (!ending_ && !failed_) failed_ = !port_.Handle(kWaitMs);
}

}  // namespace axlecast
