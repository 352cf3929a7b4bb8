#include "drivers/saa_modbus/codec.h"

#include <array>

#include "drivers/protocol/modbus/adu.h"

namespace axlecast::saa_modbus {
namespace {

constexpr std::array<std::int64_t, 5> kBauds = {2400, 4800, 9600, 19200, 57600};
constexpr std::array<Parameter, kBauds.size()> kBaudParameters = {
    Parameter::kBaud2400, Parameter::kBaud4800, Parameter::kBaud9600, Parameter::kBaud19200, Parameter::kBaud57600};

constexpr std::size_t kReadRequestSize = 8;
constexpr std::size_t kQuerySize = 4;
constexpr std::size_t kWriteSize = 5;
constexpr std::size_t kSetAddressReplySize = 4;
constexpr std::size_t kShortReplySize = 5;  // of a query, of a parameter, of an exception
constexpr std::size_t kReadOverhead = 5;    // address, function, byte count, CRC
constexpr std::uint8_t kReadException = kReadPosition | 0x80;
// (4): "two bytes (or three bytes), MSB first", and 4 by the table of (5) 2.
constexpr std::uint8_t kMinData = 2;
constexpr std::uint8_t kMaxData = 4;
constexpr int kThreeByteBits = 24;

std::optional<Parameter> KnownParameter(std::uint8_t byte) {
  const auto parameter = static_cast<Parameter>(byte);
  if (parameter == Parameter::kZero || parameter == Parameter::kPositive || parameter == Parameter::kNegative) {
    return parameter;
  }
  return BaudOf(parameter) ? std::optional(parameter) : std::nullopt;
}

bool IsAddress(std::uint8_t byte) { return byte >= kMinAddress && byte <= kMaxAddress; }

std::size_t LengthOf(std::uint8_t function, std::uint8_t third) {
  if (function == kReadPosition && third >= kMinData && third <= kMaxData) return kReadOverhead + third;
  return function == kSetAddress ? kSetAddressReplySize : kShortReplySize;
}

Reply Failed(ErrorKind kind) { return {.error = kind}; }

bool FitsRegisters(std::uint8_t data, std::uint8_t registers, int bits) {
  if (data == 2 * registers) return true;
  return registers == 2 && data == 3 && bits > kOneRegisterBits && bits <= kThreeByteBits;
}

Reply CheckPosition(const Request& request, Bytes reply, int bits) {
  if (reply[1] == kReadException) return {.error = ErrorKind::kException, .exception = reply[2]};
  if (!FitsRegisters(reply[2], request.registers, bits)) return Failed(ErrorKind::kWrongEcho);
  Reply checked;
  for (const std::uint8_t byte : reply.subspan(3, reply[2])) checked.counts = checked.counts << 8U | byte;
  if (checked.counts >> static_cast<unsigned>(bits) != 0) return Failed(ErrorKind::kRange);
  return checked;
}

// The encoder's own reply, however damaged, is not on its way any more. An exception does not contain to which
// request it belongs.
bool HasCome(const Answer& answer, const Event& event) {
  if (answer.error == ErrorKind::kRange) return true;
  return answer.error == ErrorKind::kChecksum && event.kind == Event::Kind::kReply &&
         BeginsReplyTo(answer.asked, event.bytes);
}

}  // namespace

std::span<const std::int64_t> BaudRates() { return kBauds; }

std::optional<Parameter> BaudParameter(std::int64_t baud) {
  for (std::size_t i = 0; i < kBauds.size(); ++i) {
    if (kBauds.at(i) == baud) return kBaudParameters.at(i);
  }
  return std::nullopt;
}

std::optional<std::int64_t> BaudOf(Parameter parameter) {
  for (std::size_t i = 0; i < kBauds.size(); ++i) {
    if (kBaudParameters.at(i) == parameter) return kBauds.at(i);
  }
  return std::nullopt;
}

bool Request::moves_datum() const { return function == kSetParameter && !BaudOf(parameter); }

Frame ReadRequest(std::uint8_t address, int registers) {
  return modbus::Read(address, modbus::Function::kReadHoldingRegisters, 0, static_cast<std::uint16_t>(registers));
}

Frame QueryRequest() { return modbus::Sealed({kEveryone, kQueryAddress}); }

Frame SetAddressRequest(std::uint8_t address, std::uint8_t new_address) {
  return modbus::Sealed({address, kSetAddress, new_address});
}

Frame SetParameterRequest(std::uint8_t address, Parameter parameter) {
  return modbus::Sealed({address, kSetParameter, static_cast<std::uint8_t>(parameter)});
}

std::optional<Request> ParseRequest(Bytes bytes) {
  if (!modbus::IsSealed(bytes)) return std::nullopt;
  Request request{.function = bytes[1], .address = bytes[0]};
  if (request.function == kQueryAddress && bytes.size() == kQuerySize && bytes[0] == kEveryone) return request;
  if (!IsAddress(request.address)) return std::nullopt;
  if (request.function == kReadPosition && bytes.size() == kReadRequestSize) {
    const bool from_zero = bytes[2] == 0 && bytes[3] == 0 && bytes[4] == 0;
    if (!from_zero || (bytes[5] != 1 && bytes[5] != 2)) return std::nullopt;
    request.registers = bytes[5];
    return request;
  }
  if (bytes.size() != kWriteSize) return std::nullopt;
  if (request.function == kSetAddress && IsAddress(bytes[2])) {
    request.new_address = bytes[2];
    return request;
  }
  const std::optional<Parameter> parameter = KnownParameter(bytes[2]);
  if (request.function != kSetParameter || !parameter) return std::nullopt;
  request.parameter = *parameter;
  return request;
}

std::size_t ReplyLength(Bytes so_far) {
  if (so_far.size() < 2) return 0;
  if (so_far[1] == kReadPosition && so_far.size() < 3) return 0;
  return LengthOf(so_far[1], so_far.size() < 3 ? std::uint8_t{0} : so_far[2]);
}

bool IsSealedEitherWay(Bytes bytes) {
  if (modbus::IsSealed(bytes)) return true;
  if (bytes.size() < 4) return false;
  const std::uint16_t crc = modbus::Crc16(bytes.first(bytes.size() - 2));
  return bytes[bytes.size() - 2] == crc >> 8U && bytes[bytes.size() - 1] == (crc & 0xFFU);
}

bool BeginsReplyTo(const Request& request, Bytes reply) {
  if (reply.size() < 3) return false;
  if (reply[0] != request.reply_address()) return false;
  if (request.function != kReadPosition) return reply[1] == request.function;
  if (reply[1] == kReadException) return true;
  return reply[1] == kReadPosition && reply[2] <= 2 * request.registers && reply[2] + 1 >= 2 * request.registers;
}

ReplyMatch MatchReply(Bytes request, Bytes reply) {
  const std::optional<Request> asked = ParseRequest(request);
  if (!asked) return ReplyMatch::kNo;
  // Of 17 to 24 bits two registers may be answered with three bytes.
  constexpr std::uint8_t kThreeBytes = 3;
  const bool three_bytes = asked->registers == 2 && reply.size() > 2 && reply[2] == kThreeBytes;
  const Reply checked = Check(*asked, reply, three_bytes ? 24 : kMaxBits);
  if (checked.ok()) return ReplyMatch::kYes;
  if (checked.error == ErrorKind::kException) return ReplyMatch::kRefusal;
  if (checked.error == ErrorKind::kRange) {
    return reply.size() == ReplyLength(reply) ? ReplyMatch::kYes : ReplyMatch::kNo;
  }
  if (checked.error != ErrorKind::kChecksum && checked.error != ErrorKind::kShort) return ReplyMatch::kNo;
  auto third = static_cast<std::uint8_t>(asked->parameter);
  if (asked->function == kReadPosition) third = three_bytes ? kThreeBytes : 2 * asked->registers;
  return modbus::MatchBegin(reply, {asked->reply_address(), asked->function, third});
}

ReplyShape ReplyShapeOf(Bytes request) {
  const Request asked = ParseRequest(request).value_or(Request{});
  const std::uint32_t head = std::uint32_t{asked.reply_address()} << 24U | std::uint32_t{asked.function} << 16U;
  const bool read = asked.function == kReadPosition;
  ReplyShape shape{.match = &MatchReply};
  shape.reply = head | (read ? asked.registers : static_cast<std::uint32_t>(asked.parameter));
  shape.refusal = read ? head | std::uint32_t{kReadException} << 16U : shape.reply;
  shape.exact = asked.writes();
  return shape;
}

Reply Check(const Request& request, Bytes reply, int bits) {
  const std::size_t length = ReplyLength(reply);
  if (length == 0 || reply.size() < length) return Failed(ErrorKind::kShort);
  if (reply.size() > length) return Failed(ErrorKind::kRange);
  const bool query = request.function == kQueryAddress;
  if (query && reply[1] == kQueryAddress ? !IsSealedEitherWay(reply) : !modbus::IsSealed(reply)) {
    return Failed(ErrorKind::kChecksum);
  }
  const bool exception = request.function == kReadPosition && reply[1] == kReadException;
  if (reply[0] != request.reply_address() || (reply[1] != request.function && !exception))
    return Failed(ErrorKind::kWrongEcho);
  switch (request.function) {
    case kReadPosition:
      return CheckPosition(request, reply, bits);
    case kQueryAddress:
      if (!IsAddress(reply[2])) return Failed(ErrorKind::kRange);
      return {.address = reply[2]};
    case kSetParameter:
      if (reply[2] != static_cast<std::uint8_t>(request.parameter)) return Failed(ErrorKind::kWrongEcho);
      return {};
    default:
      return {};
  }
}

Answer Interpret(const Event& event, int bits) {
  Answer answer;
  answer.asked = ParseRequest(event.request).value_or(Request{});
  if (event.bytes.empty()) {
    answer.error = ErrorKind::kTimeout;
  } else {
    answer.reply = Check(answer.asked, event.bytes, bits);
    answer.error = answer.reply.error;
    if (!answer.error && event.kind == Event::Kind::kTimeout) answer.error = ErrorKind::kShort;
  }
  answer.unanswered = answer.error && !HasCome(answer, event);
  return answer;
}

}  // namespace axlecast::saa_modbus
