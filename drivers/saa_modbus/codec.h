#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "core/base/inline_bytes.h"
#include "core/device/reading.h"
#include "core/device/step.h"

namespace axlecast::saa_modbus {

// Frames of SAA encoders on Modbus RTU, both directions, free of I/O: SAA manual 5.1.7. In addition to function 03, the
// encoder has three functions of its own, which have no exception replies.

inline constexpr std::uint8_t kReadPosition = 0x03;  // item 4, (5) 1 and 2
inline constexpr std::uint8_t kQueryAddress = 0xA0;  // (5) 3
inline constexpr std::uint8_t kSetAddress = 0xA1;    // (5) 4, there mistitled "Check Device Address"
inline constexpr std::uint8_t kSetParameter = 0xCC;  // (5) 5

inline constexpr std::uint8_t kEveryone = 0xFF;  // the address in a query
inline constexpr std::uint8_t kMinAddress = 1;
inline constexpr std::uint8_t kMaxAddress = 247;  // Modbus over Serial Line V1.02, 2.2

inline constexpr int kMinBits = 10;  // 4.1
inline constexpr int kMaxBits = 26;
// The maximum resolution whose position fits into one register.
inline constexpr int kOneRegisterBits = 16;

// (5) 5, "Definition of Setting".
enum class Parameter : std::uint8_t {
  kZero = 0x00,
  kPositive = 0x01,
  kNegative = 0x02,
  kBaud2400 = 0x24,
  kBaud4800 = 0x48,
  kBaud9600 = 0x96,
  kBaud19200 = 0x19,
  kBaud57600 = 0x57,
};
// The rates of (2), slowest first.
[[nodiscard]] std::span<const std::int64_t> BaudRates();
[[nodiscard]] std::optional<Parameter> BaudParameter(std::int64_t baud);
[[nodiscard]] std::optional<std::int64_t> BaudOf(Parameter parameter);

// The content of a request.
struct Request {
  std::uint8_t function = kReadPosition;
  std::uint8_t address = 0;      // kEveryone in a query
  std::uint8_t registers = 0;    // of kReadPosition: 1 or 2
  std::uint8_t new_address = 0;  // of kSetAddress
  Parameter parameter{};         // of kSetParameter

  [[nodiscard]] bool writes() const { return function == kSetAddress || function == kSetParameter; }
  // Returns whether the same shaft angle has other counts after it.
  [[nodiscard]] bool moves_datum() const;
  [[nodiscard]] std::uint8_t reply_address() const { return function == kSetAddress ? new_address : address; }
};

[[nodiscard]] Frame ReadRequest(std::uint8_t address, int registers);
[[nodiscard]] Frame QueryRequest();
[[nodiscard]] Frame SetAddressRequest(std::uint8_t address, std::uint8_t new_address);
[[nodiscard]] Frame SetParameterRequest(std::uint8_t address, Parameter parameter);
// Returns nothing if the bytes are not one of the four requests.
[[nodiscard]] std::optional<Request> ParseRequest(Bytes bytes);

// An axlecast::ReplyLength: returns the length of the reply that begins so, by its function code.
[[nodiscard]] std::size_t ReplyLength(Bytes so_far);

struct Reply {
  // kShort, kChecksum, kWrongEcho (another address, function, parameter or number of registers than requested),
  // kException, kRange (counts above the resolution, or an impossible address).
  std::optional<ErrorKind> error = {};
  std::uint8_t exception = 0;  // with kException
  std::uint32_t counts = 0;    // of kReadPosition
  std::uint8_t address = 0;    // of a query: the encoder's

  [[nodiscard]] bool ok() const { return !error.has_value(); }
};
// Decodes the reply to `request` of an encoder with `bits`.
[[nodiscard]] Reply Check(const Request& request, Bytes reply, int bits);
// Returns whether these are the first bytes of the reply to `request`, whatever follows.
[[nodiscard]] bool BeginsReplyTo(const Request& request, Bytes reply);

// An axlecast::MatchReply, for an encoder of any resolution.
[[nodiscard]] ReplyMatch MatchReply(Bytes request, Bytes reply);
// Distinguishes replies by address, function, and number of registers or parameter.
[[nodiscard]] ReplyShape ReplyShapeOf(Bytes request);

// Checks the CRC in either byte order, for the reply to a query: the manual states MSB first for this reply alone, but
// its own example of the request is LSB first.
[[nodiscard]] bool IsSealedEitherWay(Bytes bytes);

// The result of one exchange.
struct Answer {
  Request asked;
  std::optional<ErrorKind> error;  // nothing: the reply fits the request
  Reply reply;
  bool unanswered = false;  // the reply has not come: it may still come, later

  [[nodiscard]] bool ok() const { return !error; }
};

// Returns the answer of an exchange. It depends on the event (kReply or kTimeout) alone.
[[nodiscard]] Answer Interpret(const Event& event, int bits);

}  // namespace axlecast::saa_modbus
