#pragma once

#include <memory>
#include <string>
#include <vector>

#include "drivers/hal/line_reader.h"
#include "drivers/hal/serial_port.h"

namespace axlecast {

// A Modbus RTU line that libmodbus opens and sends on, with none of its recovery modes. Replies are read as raw
// bytes: libmodbus hides bytes and instants, and takes a late reply for the answer of another unit. What its users
// do with modbus_flush before each request is the Medium's: it reports as stray what came unasked. So nothing is
// dropped here, but for what came before Open. After kLost, or a Write that returned false, Close and Open again:
// every Open begins at the settings' rate. One thread uses it; Wake may be called from any.
class ModbusPort final : public ByteLink {
 public:
  ModbusPort(SerialSettings settings, const Clock& clock);
  ~ModbusPort() override;
  ModbusPort(const ModbusPort&) = delete;
  ModbusPort& operator=(const ModbusPort&) = delete;

  [[nodiscard]] Result<> Open() override;
  void Close() override;
  [[nodiscard]] bool IsOpen() const override { return reader_.IsAttached(); }
  // Lets libmodbus close the port and open it anew, in our hands all the while; what was written goes out first,
  // what came stays to be read. False at a rate that libmodbus or the adapter does not make.
  [[nodiscard]] bool SetBaud(std::int64_t baud) override;
  // One request: 4 to 256 bytes, the last two its CRC. libmodbus puts its own there. A frame whose CRC is another
  // is not sent: false.
  [[nodiscard]] bool HasWire() const override { return !tty_.IsPty(); }
  [[nodiscard]] bool Write(Bytes frame) override;
  [[nodiscard]] ReadResult Read(std::span<std::uint8_t> into, MonoNs deadline) override {
    return reader_.Read(into, deadline);
  }
  [[nodiscard]] ReadResult ReadNow(std::span<std::uint8_t> into) override { return reader_.ReadNow(into); }
  [[nodiscard]] Status Wait(MonoNs until) override { return reader_.Wait(until); }
  void Wake() override { reader_.Wake(); }
  [[nodiscard]] LineErrors Errors() const override { return tty_.Errors(); }

  // What the last successful Open found wanting, each with its remedy.
  [[nodiscard]] const std::vector<std::string>& warnings() const { return tty_.warnings(); }

 private:
  struct Session;

  [[nodiscard]] Result<> Connect(std::int64_t baud);
  void Disconnect();

  const Clock& clock_;
  Tty tty_;
  std::unique_ptr<Session> session_;  // closed before the claim on the line goes
  LineReader reader_;
};

}  // namespace axlecast
