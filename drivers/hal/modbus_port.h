#pragma once

#include <memory>

#include "drivers/hal/serial_port.h"

namespace axlecast {

// A Modbus RTU line. libmodbus opens it and sends the requests, without its recovery modes. Replies are read as raw bytes,
// because libmodbus hides bytes and timestamps, and accepts a late reply as the answer of another unit. Nothing is dropped,
// except what came before Open: the Transactor reports bytes that came without a request. After kLost, or after Write
// returned false, call Close and Open again; Open sets the rate of the settings. Used by one thread, except Wake.
class ModbusPort final : public TtyPort {
 public:
  ModbusPort(SerialSettings settings, const Clock& clock);
  ~ModbusPort() override;

  [[nodiscard]] Result<> Open() override;
  void Close() override;
  // Lets libmodbus close and reopen the port, which stays claimed. Written bytes are sent first, and received bytes can
  // still be read. Returns false if libmodbus or the adapter does not support the rate.
  [[nodiscard]] bool SetBaud(std::int64_t baud) override;
  // Sends one request of 4 to 256 bytes, including its CRC. Returns false, and sends nothing, if the CRC is wrong.
  [[nodiscard]] bool Write(Bytes frame) override;

 private:
  struct Session;

  [[nodiscard]] Result<> Connect(std::int64_t baud);
  void Disconnect();

  std::unique_ptr<Session> session_;  // closed before tty_ releases the line
};

}  // namespace axlecast
