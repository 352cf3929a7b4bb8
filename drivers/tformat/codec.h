#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/device/device.h"
#include "core/device/reading.h"
#include "core/device/step.h"

// T-format as the maker specifies it: Tamagawa "Specification of Smart Abs TS5669 N127" (the "spec" below),
// chapters 6 to 9. One field of the frame (start bit, 8 data bits LSB first, delimiter) is one UART character 8N1
// at 2.5 Mbit/s; a codec sees only the data bits. Pure functions of bytes.
namespace axlecast::tformat {

// Spec 6.3.1, Table 1.
enum class DataId : std::uint8_t {
  kSingleTurn = 0x0,  // readout: ABS
  kMultiTurn = 0x1,   // readout: ABM
  kEncoderId = 0x2,   // readout: ENID
  kAll = 0x3,         // readout: ABS, ENID, ABM, ALMC
  kEepromWrite = 0x6,
  kClearErrors = 0x7,          // reset: all latched errors
  kZeroSingleTurn = 0x8,       // reset: single-turn to 0
  kResetTurnsAndErrors = 0xC,  // reset: multi-turn to 0 and all latched errors
  kEepromRead = 0xD,
};
inline constexpr std::array<DataId, 9> kDataIds = {
    DataId::kSingleTurn,  DataId::kMultiTurn,   DataId::kEncoderId,      DataId::kAll,
    DataId::kEepromWrite, DataId::kClearErrors, DataId::kZeroSingleTurn, DataId::kResetTurnsAndErrors,
    DataId::kEepromRead};

// Control field of a data ID: sink code 0 1 0, the ID's four bits cc0 first, its parity cc4.
[[nodiscard]] constexpr std::uint8_t ControlField(DataId id) {
  const auto bits = static_cast<unsigned>(id);
  const unsigned parity = (bits ^ bits >> 1U ^ bits >> 2U ^ bits >> 3U) & 1U;
  return static_cast<std::uint8_t>(0x02U | bits << 3U | parity << 7U);
}
// Returns nothing if the sink code or the parity is wrong, or the ID is not in Table 1.
[[nodiscard]] std::optional<DataId> ParseControlField(std::uint8_t field);

// G(X) = X^8 + 1 over whole bytes (spec 6.3.4).
[[nodiscard]] std::uint8_t Crc(Bytes bytes);

// Status field, spec 6.3.2, Figure 5.
inline constexpr std::uint8_t kSfInformation = 0x0F;    // always 0
inline constexpr std::uint8_t kSfCountingError = 0x10;  // ea0
inline constexpr std::uint8_t kSfMultiTurn = 0x20;      // ea1: ME, BE or BA
inline constexpr std::uint8_t kSfParity = 0x40;         // ca0: the request's ID parity was wrong
inline constexpr std::uint8_t kSfDelimiter = 0x80;      // ca1: the request's delimiter was wrong

// ALMC, spec 6.3.3, Table 3.
inline constexpr std::uint8_t kAlmOverSpeed = 0x01;        // OS, latched
inline constexpr std::uint8_t kAlmFullAbsolute = 0x02;     // FS: 5 bits of accuracy until it clears itself
inline constexpr std::uint8_t kAlmCountingError = 0x04;    // CE
inline constexpr std::uint8_t kAlmCounterOverflow = 0x08;  // OF, latched
inline constexpr std::uint8_t kAlmAlwaysZero = 0x10;
inline constexpr std::uint8_t kAlmMultiTurnError = 0x20;  // ME, latched
inline constexpr std::uint8_t kAlmBatteryError = 0x40;    // BE, latched
inline constexpr std::uint8_t kAlmBatteryAlarm = 0x80;    // BA
// The bits of which ea1 is the OR, spec 6.3.2 (3).
inline constexpr std::uint8_t kEa1Alarms = kAlmMultiTurnError | kAlmBatteryError | kAlmBatteryAlarm;

inline constexpr std::uint8_t kEepromCells = 80;  // addresses 0..79 are open to the user, spec 6.1.1
inline constexpr std::uint8_t kBusy = 0x80;       // of the ADF, spec 6.3.5

// What of a reply's checks depends on the model.
struct Format {
  int single_turn_bits = 17;  // 1..24; ABS bits above are always zero
  int multi_turn_bits = 16;   // 0..24; ABM bits above are always zero
};

// Requests. Address 0..79.
[[nodiscard]] Frame Request(DataId id);  // the readouts and resets
[[nodiscard]] Frame EepromReadRequest(std::uint8_t address);
[[nodiscard]] Frame EepromWriteRequest(std::uint8_t address, std::uint8_t data);

// True for the two IDs whose frames carry address, data and CRC but no status field (spec 6.2.2, 6.2.3).
[[nodiscard]] constexpr bool IsEeprom(DataId id) { return id == DataId::kEepromWrite || id == DataId::kEepromRead; }
[[nodiscard]] constexpr bool IsReset(DataId id) {
  return id == DataId::kClearErrors || id == DataId::kZeroSingleTurn || id == DataId::kResetTurnsAndErrors;
}
// TS5669 spec 9: "Transmit 10 times in one sequence with the interval of 40 ms or more".
inline constexpr int kResetTimes = 10;

// Bytes of a request with this ID: readouts and resets are the control field alone, without CRC (spec 6.2).
[[nodiscard]] constexpr std::size_t RequestSize(DataId id) {
  return id == DataId::kEepromWrite ? 4 : id == DataId::kEepromRead ? 3 : 1;
}
// Bytes of the reply to a request with this ID, CF to CRC.
inline constexpr std::size_t kLongestReply = 11;
[[nodiscard]] constexpr std::size_t ReplySize(DataId id) {
  if (id == DataId::kAll) return kLongestReply;
  return IsEeprom(id) || id == DataId::kEncoderId ? 4 : 6;
}

// Why a reply is no reading. A checked reply can still carry alarms: they are fields, not errors.
enum class ReplyError : std::uint8_t {
  kNone,
  kShort,  // fewer bytes than the reply has
  kLong,   // more
  kChecksum,
  kWrongEcho,           // the control field, or what Table 4 makes an EEPROM reply echo, answers another request
  kCommunicationAlarm,  // SF reports that the request arrived damaged: discard, send it again (spec 6.3.2 (4))
  kAbnormalReply,       // ID 3's data although something else was asked: the request was abnormal (spec 7.4, 8.4)
  kRange,               // always-zero bits are set
};
[[nodiscard]] const char* ReplyErrorName(ReplyError error);  // the `error` word of `axlecast decode`

// A decoded reply. A field holds a value only when the reply has it.
struct Reply {
  ReplyError error = ReplyError::kNone;
  DataId id{};                               // whose data it is; means nothing where no field is filled in
  std::optional<std::uint8_t> status;        // SF
  std::optional<std::uint32_t> single_turn;  // ABS
  std::optional<std::uint32_t> multi_turn;   // ABM
  std::optional<std::uint8_t> encoder_id;    // ENID
  std::optional<std::uint8_t> alarms;        // ALMC
  std::optional<std::uint8_t> address;       // ADF without busy
  std::optional<bool> busy;
  std::optional<std::uint8_t> data;  // EDF; absent while busy
};

// The reply to `request`. A request that ParseRequest refuses is abnormal: its answer is ID 3's data (spec Tables
// 5, 6).
//
// The first check that fails names the error:
//   1. Length. The request's ID defines the length of its reply, because the reply's own control field may be damaged.
//      11 bytes with a right CRC and ID 3's always-zero bits clear, where another ID was asked, are the answer to
//      an abnormal request: kAbnormalReply, or kCommunicationAlarm if SF reports it. What control field comes with
//      them is not specified, so any will do.
//   2. CRC. It finds every single flipped bit, but no swapped bytes and no two flips of one bit position.
//   3. Communication alarm in SF, ahead of the echo for the same reason; an EEPROM reply has no SF.
//   4. Echo: the control field; for the EEPROM also the address and, when a write was accepted, the data (Table 4).
//   5. Always-zero bits: SF's information bits, ABS and ABM above the model's bits, ALMC d74, EDF while busy.
//
// A field is filled in only where error is kNone, with two exceptions, for alarms only and never a reading:
// kCommunicationAlarm always holds SF, and it and kAbnormalReply hold ID 3's data where its always-zero bits are
// clear.
[[nodiscard]] Reply ParseReply(Bytes request, Bytes reply, const Format& format);

// A reply as the encoder sends it: the other direction, for simulators. A field that its ID has and `reply` lacks
// is sent as 0; `error` is not looked at.
[[nodiscard]] Frame MakeReply(const Reply& reply);

// What a well-formed request holds.
struct RequestFields {
  DataId id{};
  std::optional<std::uint8_t> address;
  std::optional<std::uint8_t> data;
};
// Nothing when the encoder would take it for abnormal: length, CRC or address (0..79) are wrong, or the control
// field is.
[[nodiscard]] std::optional<RequestFields> ParseRequest(Bytes request);

// ---- one exchange: events in, answers out ----

// What a reply is checked against.
struct Expectation {
  Format format;
  std::uint8_t encoder_id = 0;
  bool echo = false;  // the adapter receives its own transmission
};

// The result of one exchange.
struct Answer {
  DataId asked{};                  // the ID of the request
  std::optional<ErrorKind> error;  // nothing: the reply is what was asked for
  Reply reply;                // its fields; with an error only alarms (kAbnormalReply) or ENID (kWrongIdentity)
  bool line_unclear = false;  // bytes may still be on their way: silence before the next request
  bool not_taken = false;     // the encoder reports that it did not execute the request

  [[nodiscard]] bool ok() const { return !error; }
};

// Returns the result of an exchange. It depends only on the event (kReply or kTimeout).
[[nodiscard]] Answer Interpret(const Event& event, const Expectation& expected);

// Exchanges, with the rule for the end of their replies and the bytes that distinguish the replies: the control field,
// and the address of an EEPROM cell. An encoder that misread the request answers with the 11 bytes of ID 3.
[[nodiscard]] Exchange Ask(DataId id, MonoNs timeout);
[[nodiscard]] Exchange AskCell(std::uint8_t address, MonoNs timeout);
[[nodiscard]] Exchange WriteCell(std::uint8_t address, std::uint8_t data, MonoNs timeout);

// Returns the ID of a request of an event.
[[nodiscard]] std::optional<DataId> RequestId(Bytes request);

// ---- alarms ----

// An alarm bit of ALMC: TS5669 spec 6.3.3, Table 3, with the action of spec 6.4.
struct DeviceAlarm {
  std::uint8_t bit;    // of ALMC
  const char* symbol;  // the maker's: OS, FS, CE, OF, ME, BE, BA
  bool latched;        // kept by the encoder until it is reset by command
  AlarmSpec spec;      // code 0x100 + the bit's number
};

// In the order of their bits.
[[nodiscard]] const std::array<DeviceAlarm, 7>& DeviceAlarms();

extern const AlarmSpec kWrongIdentity;
extern const AlarmSpec kMisreadRequest;

// Returns all of them.
[[nodiscard]] std::vector<AlarmSpec> Alarms();

// Bits that a reset of errors clears when their cause is gone. CE belongs to them because its case II is latched
// (spec 9), which ALMC does not distinguish from case I.
inline constexpr std::uint8_t kLatchedAlarms = 0x6D;
// Bits after which the multi-turn counter may be wrong: OS, ME, BE.
inline constexpr std::uint8_t kTurnsInDoubt = 0x61;
// Bits that concern the multi-turn counter or its battery: OS, OF, ME, BE, BA.
inline constexpr std::uint8_t kMultiTurnAlarms = 0xE9;

// "0x48 OF BE"
[[nodiscard]] std::string AlarmText(std::uint8_t alarms);

}  // namespace axlecast::tformat
