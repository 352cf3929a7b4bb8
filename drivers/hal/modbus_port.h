#pragma once

#include <memory>
#include <string>
#include <vector>

#include "drivers/hal/line_reader.h"
#include "drivers/hal/serial_port.h"

namespace axlecast {

// A Modbus RTU line. libmodbus opens it and sends the requests, without its recovery modes. Replies are read as raw bytes,
// because libmodbus hides bytes and timestamps, and accepts a late reply as the answer of another unit. Nothing is dropped,
// except what came before Open: the Transactor reports bytes that came without a request. After kLost, or after Write
// returned false, call Close and Open again; Open sets the rate of the settings. Used by one thread, except Wake.
class ModbusPort final : public ByteLink {
 public:
  ModbusPort(SerialSettings settings, const Clock& clock);
  ~ModbusPort() override;

  [[nodiscard]] Result<> Open() override;
  void Close() override;
  [[nodiscard]] bool IsOpen() const override { return reader_.IsAttached(); }
  // Lets libmodbus close and reopen the port, which stays claimed. Written bytes are sent first, and received bytes can
  // still be read. Returns false if libmodbus or the adapter does not support the rate.
  [[nodiscard]] bool SetBaud(std::int64_t baud) override;
  [[nodiscard]] bool HasWire() const override { return !tty_.IsPty(); }
  // Sends one request of 4 to 256 bytes, including its CRC. Returns false, and sends nothing, if the CRC is wrong.
  [[nodiscard]] bool Write(Bytes frame) override;
  [[nodiscard]] ReadResult Read(std::span<std::uint8_t> into, MonoNs deadline) override {
    return reader_.Read(into, deadline);
  }
  [[nodiscard]] ReadResult ReadNow(std::span<std::uint8_t> into) override { return reader_.ReadNow(into); }
  [[nodiscard]] Status Wait(MonoNs until) override { return reader_.Wait(until); }
  void Wake() override { reader_.Wake(); }
  [[nodiscard]] LineErrors Errors() const override { return tty_.Errors(); }

  // Warnings of the last successful Open, each with its remedy.
  [[nodiscard]] const std::vector<std::string>& warnings() const { return tty_.warnings(); }

 private:
  struct Session;

  [[nodiscard]] Result<> Connect(std::int64_t baud);
  void Disconnect();

  const Clock& clock_;
  Tty tty_;
  std::unique_ptr<Session> session_;  // closed before tty_ releases the line
  LineReader reader_;
};

}  // namespace axlecast
