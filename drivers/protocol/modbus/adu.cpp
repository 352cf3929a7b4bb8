#include "drivers/protocol/modbus/adu.h"

#include <algorithm>
#include <bit>
#include <cassert>

namespace axlecast::modbus {
namespace {

constexpr std::uint8_t kExceptionBit = 0x80;     // Application Protocol V1.1b3, 7
constexpr std::size_t kExceptionSize = 5;        // address, function, code, CRC
constexpr std::size_t kEchoSize = 8;             // address, function, two words, CRC
constexpr std::size_t kReadOverhead = 5;         // address, function, byte count, CRC
constexpr std::size_t kMaxAdu = 256;             // Serial Line V1.02, 2.5.1
constexpr std::size_t kMaxWriteRegisters = 123;  // Application Protocol V1.1b3, 6.12

// Serial Line V1.02, 6.2.2: polynomial 0xA001 (reflected), one table entry a byte.
constexpr std::array<std::uint16_t, 256> MakeCrcTable() {
  std::array<std::uint16_t, 256> table{};
  for (unsigned byte = 0; byte < table.size(); ++byte) {
    unsigned crc = byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1U) != 0 ? (crc >> 1U) ^ 0xA001U : crc >> 1U;
    table[byte] = static_cast<std::uint16_t>(crc);
  }
  return table;
}
constexpr std::array<std::uint16_t, 256> kCrcTable = MakeCrcTable();

std::uint8_t High(std::uint16_t word) { return static_cast<std::uint8_t>(word >> 8U); }
std::uint8_t Low(std::uint16_t word) { return static_cast<std::uint8_t>(word & 0xFFU); }
std::uint16_t Word(Bytes bytes, std::size_t at) {
  return static_cast<std::uint16_t>((bytes[at] << 8U) | bytes[at + 1]);
}

Frame TwoWords(std::uint8_t address, Function function, std::uint16_t first, std::uint16_t second) {
  return {address, static_cast<std::uint8_t>(function), High(first), Low(first), High(second), Low(second)};
}

bool SameStart(Bytes a, Bytes b, std::size_t count) {
  return a.size() >= count && b.size() >= count &&
         std::equal(a.begin(), a.begin() + static_cast<std::ptrdiff_t>(count), b.begin());
}

// How the reply to a function is built.
enum class Form : std::uint8_t { kBits, kRegisters, kServerId, kWrite, kUnknown };

Form FormOf(std::uint8_t function) {
  switch (static_cast<Function>(function)) {
    case Function::kReadCoils:
    case Function::kReadDiscreteInputs:
      return Form::kBits;
    case Function::kReadHoldingRegisters:
    case Function::kReadInputRegisters:
      return Form::kRegisters;
    case Function::kReportServerId:
      return Form::kServerId;
    case Function::kWriteCoil:
    case Function::kWriteRegister:
    case Function::kWriteCoils:
    case Function::kWriteRegisters:
      return Form::kWrite;
  }
  return Form::kUnknown;
}

// Returns the byte count of a good reply to a read of at least kEchoSize bytes.
std::size_t ReadSize(Bytes request) {
  const std::size_t count = Word(request, 4);
  return FormOf(request[1]) == Form::kBits ? (count + 7) / 8 : 2 * count;
}

// Returns the third byte of a good reply: the byte count of a read, the high byte of a write's first address.
std::uint8_t ThirdOfReply(Bytes request) {
  if (FormOf(request[1]) == Form::kWrite) return request[2];
  return request.size() < kEchoSize ? std::uint8_t{0} : static_cast<std::uint8_t>(ReadSize(request));
}

Reply Failed(ErrorKind kind, std::uint8_t exception = 0) { return {.error = kind, .exception = exception}; }

// Checks a sealed reply of the right length, to a request of the same function.
Reply CheckContent(Bytes request, Bytes reply) {
  const Form form = FormOf(request[1]);
  const bool read = form == Form::kBits || form == Form::kRegisters;
  if (read && request.size() >= kEchoSize) {
    if (reply[2] != ReadSize(request)) return Failed(ErrorKind::kRange);
    return {.data = reply.subspan(3, reply[2])};
  }
  if (form == Form::kServerId) return {.data = reply.subspan(3, reply[2])};
  if (form == Form::kWrite && SameStart(request, reply, kEchoSize - 2)) return {};
  return Failed(ErrorKind::kWrongEcho);
}

}  // namespace

std::uint16_t Crc16(Bytes bytes) {
  unsigned crc = 0xFFFF;
  for (const std::uint8_t byte : bytes) crc = (crc >> 8U) ^ kCrcTable[(crc ^ byte) & 0xFFU];
  return static_cast<std::uint16_t>(crc);
}

Frame Sealed(Frame frame) {
  const std::uint16_t crc = Crc16(frame);
  frame.Append(Low(crc));
  frame.Append(High(crc));
  return frame;
}

bool IsSealed(Bytes adu) {
  if (adu.size() < 4) return false;
  const std::size_t end = adu.size() - 2;
  const std::uint16_t crc = Crc16(adu.first(end));
  return adu[end] == Low(crc) && adu[end + 1] == High(crc);
}

Frame Read(std::uint8_t address, Function function, std::uint16_t start, std::uint16_t count) {
  assert(function >= Function::kReadCoils && function <= Function::kReadInputRegisters);
  return Sealed(TwoWords(address, function, start, count));
}

Frame WriteCoil(std::uint8_t address, std::uint16_t coil, bool on) {
  return Sealed(TwoWords(address, Function::kWriteCoil, coil, on ? kCoilOn : kCoilOff));
}

Frame WriteRegister(std::uint8_t address, std::uint16_t start, std::uint16_t value) {
  return Sealed(TwoWords(address, Function::kWriteRegister, start, value));
}

Frame WriteRegisters(std::uint8_t address, std::uint16_t start, std::span<const std::uint16_t> values) {
  assert(!values.empty() && values.size() <= kMaxWriteRegisters);
  const std::size_t count = std::min(values.size(), kMaxWriteRegisters);
  Frame frame = TwoWords(address, Function::kWriteRegisters, start, static_cast<std::uint16_t>(count));
  frame.Append(static_cast<std::uint8_t>(2 * count));
  for (const std::uint16_t value : values.first(count)) {
    frame.Append(High(value));
    frame.Append(Low(value));
  }
  return Sealed(frame);
}

std::size_t ReplyLength(Bytes so_far) {
  if (so_far.size() < 2) return 0;
  const Form form = FormOf(so_far[1]);
  if (form == Form::kWrite) return kEchoSize;
  if (form == Form::kUnknown) return kExceptionSize;
  if (so_far.size() < 3) return 0;
  const std::size_t length = kReadOverhead + so_far[2];
  return length <= kMaxAdu ? length : kExceptionSize;
}

ReplyMatch MatchBegin(Bytes reply, std::array<std::uint8_t, 3> head) {
  constexpr int kMaxInverted = 2;
  if (reply.size() < kExceptionSize) return ReplyMatch::kNo;
  int inverted = 0;
  for (std::size_t i = 0; i < head.size(); ++i)
    inverted += std::popcount(static_cast<unsigned>(reply[i] ^ head[i]));
  if (inverted > kMaxInverted) return ReplyMatch::kNo;
  return inverted == 0 ? ReplyMatch::kDamaged : ReplyMatch::kNearly;
}

ReplyMatch MatchReply(Bytes request, Bytes reply) {
  if (request.size() < 4) return ReplyMatch::kNo;
  const Reply checked = Check(request, reply);
  if (checked.ok()) return ReplyMatch::kYes;
  if (checked.error == ErrorKind::kException) return ReplyMatch::kRefusal;
  if (checked.error != ErrorKind::kChecksum && checked.error != ErrorKind::kShort) return ReplyMatch::kNo;
  return MatchBegin(reply, {request[0], request[1], ThirdOfReply(request)});
}

ReplyShape ShapeOf(Bytes request) {
  const std::uint32_t head = std::uint32_t{request[0]} << 24U | std::uint32_t{request[1]} << 16U;
  const bool write = FormOf(request[1]) == Form::kWrite;
  const std::uint32_t rest = request.size() < kEchoSize ? 0 : write ? Word(request, 2) : ThirdOfReply(request);
  return {.reply = head | rest,
          .refusal = head | std::uint32_t{kExceptionBit} << 16U,
          .match = &MatchReply,
          .exact = write};
}

Reply Check(Bytes request, Bytes reply) {
  const std::size_t length = ReplyLength(reply);
  if (length == 0 || reply.size() < kExceptionSize || reply.size() < length) return Failed(ErrorKind::kShort);
  if (!IsSealed(reply)) return Failed(ErrorKind::kChecksum);
  if (reply.size() > length) return Failed(ErrorKind::kRange);
  if (request.size() < 2 || reply[0] != request[0]) return Failed(ErrorKind::kWrongEcho);
  const bool standard = (request[1] & kExceptionBit) == 0;
  if (standard && reply[1] == (request[1] | kExceptionBit)) return Failed(ErrorKind::kException, reply[2]);
  if (reply[1] != request[1]) return Failed(ErrorKind::kWrongEcho);
  return CheckContent(request, reply);
}

}  // namespace axlecast::modbus
