#include "drivers/hal/modbus_port.h"

#include <modbus.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "drivers/protocol/modbus/adu.h"

namespace axlecast {
namespace {

constexpr std::size_t kCrcSize = 2;
constexpr std::size_t kLongestAdu = MODBUS_MAX_PDU_LENGTH + 1 + kCrcSize;

// libmodbus 3.1.6, modbus-rtu.c: _modbus_rtu_connect. It replaces any other rate by 9600 without an error.
constexpr std::int64_t kRates[] = {110,       300,       600,       1'200,     2'400,     4'800,
                                   9'600,     19'200,    38'400,    57'600,    115'200,   230'400,
                                   460'800,   500'000,   576'000,   921'600,   1'000'000, 1'152'000,
                                   1'500'000, 2'500'000, 3'000'000, 3'500'000, 4'000'000};

bool KnowsRate(std::int64_t baud) {
  return std::find(std::begin(kRates), std::end(kRates), baud) != std::end(kRates);
}

Result<> CheckRate(std::int64_t baud) {
  if (KnowsRate(baud)) return {};
  std::string text = "link.baud " + std::to_string(baud) + " is no rate of the Modbus library; it knows ";
  for (const std::int64_t rate : kRates) text += (rate == kRates[0] ? "" : ", ") + std::to_string(rate);
  return Failure(text);
}

char ParityLetter(Parity parity) {
  switch (parity) {
    case Parity::kEven:
      return 'E';
    case Parity::kOdd:
      return 'O';
    case Parity::kNone:
      break;
  }
  return 'N';
}

}  // namespace

struct ModbusPort::Session {
  explicit Session(modbus_t* context) : modbus(context) {}
  ~Session() {
    if (modbus == nullptr) return;
    modbus_close(modbus);
    modbus_free(modbus);
  }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  modbus_t* const modbus;
};

ModbusPort::ModbusPort(SerialSettings settings, const Clock& clock) : TtyPort(std::move(settings), clock) {}

ModbusPort::~ModbusPort() = default;

Result<> ModbusPort::Open() {
  Close();
  const std::int64_t baud = tty_.settings().format.baud;
  Result<> opened = reader_.CheckReady()
                        .and_then([&] { return CheckRate(baud); })
                        .and_then([&] { return tty_.Claim(); })
                        .and_then([&] { return Connect(baud); })
                        .and_then([&] { return tty_.Reset(); });
  if (!opened) Close();
  return opened;
}

Result<> ModbusPort::Connect(std::int64_t baud) {
  LineFormat format = tty_.settings().format;
  format.baud = baud;
  // A pty refuses parity (glibc's tcsetattr reads back and reports EINVAL).
  const char parity = tty_.IsPty() ? 'N' : ParityLetter(format.parity);
  const std::string line_path = tty_.OpenPath();
  session_ = std::make_unique<Session>(
      modbus_new_rtu(line_path.c_str(), static_cast<int>(baud), parity, 8, format.stop_bits));
  if (session_->modbus == nullptr || modbus_connect(session_->modbus) != 0) return tty_.OpenFailure(errno);
  const int line = modbus_get_socket(session_->modbus);
  if (!tty_.IsBehind(line)) return tty_.OpenFailure(ENXIO);
  Result<> connected = tty_.Exclude().and_then([&] { return tty_.AdoptFormat(format); });
  if (connected) reader_.Attach(line);
  return connected;
}

void ModbusPort::Disconnect() {
  reader_.Detach();
  session_.reset();
}

void ModbusPort::Close() {
  Disconnect();
  tty_.Release();
}

bool ModbusPort::SetBaud(std::int64_t baud) {
  if (!IsOpen() || !KnowsRate(baud) || !tty_.CanMake(baud) || !tty_.Drain() || !tty_.Admit()) return false;
  Disconnect();
  if (Connect(baud)) return true;
  Close();
  return false;
}

bool ModbusPort::Write(Bytes frame) {
  if (!IsOpen() || frame.size() > kLongestAdu || !modbus::IsSealed(frame)) return false;
  const Bytes request = frame.first(frame.size() - kCrcSize);
  MonoNs give_up = 0;
  while (true) {
    const int sent = modbus_send_raw_request(session_->modbus, request.data(), static_cast<int>(request.size()));
    if (sent == static_cast<int>(frame.size())) return true;
    if (sent < 0 && errno == EINTR) continue;
    // EAGAIN: the line accepted no byte. If it accepted a part of the frame, the frame is broken.
    if (sent >= 0 || errno != EAGAIN) return false;
    if (give_up == 0) give_up = clock_.Now() + kWriteTimeout;
    if (!reader_.WaitWritable(give_up)) return false;
  }
}

}  // namespace axlecast
