#include "drivers/protocol/canopen/canopen.h"

#include <algorithm>
#include <utility>

namespace axlecast::canopen {
namespace {

// The command specifiers of 7.2.4.3, in the upper three bits of the first byte. Client: 1 download, 2 upload, 4
// abort; server: 2 upload, 3 download, 4 abort.
constexpr unsigned kDownload = 1;
constexpr unsigned kUpload = 2;
constexpr unsigned kDownloadAnswer = 3;
constexpr unsigned kAbort = 4;
constexpr std::uint8_t kExpedited = 0x02;
constexpr std::uint8_t kSizeGiven = 0x01;

constexpr std::size_t kHeadSize = 4;

ObjectId ObjectOf(Bytes data) { return {static_cast<std::uint16_t>(LittleEndian(data, 1, 2)), data[3]}; }

CanFrame SdoFrame(std::uint8_t node, std::uint8_t command, ObjectId object, std::uint32_t value) {
  CanFrame frame{.id = kSdoRequestId + node, .data = {}};
  frame.data.Append(command);
  frame.data.Append(static_cast<std::uint8_t>(object.index));
  frame.data.Append(static_cast<std::uint8_t>(object.index >> 8));
  frame.data.Append(object.sub);
  for (unsigned shift = 0; shift < 32; shift += 8) frame.data.Append(static_cast<std::uint8_t>(value >> shift));
  return frame;
}

// Bytes of data that an expedited command byte announces: all four if it gives no size.
std::uint8_t AnnouncedSize(std::uint8_t command) {
  return (command & kSizeGiven) != 0 ? static_cast<std::uint8_t>(4 - (command >> 2 & 3)) : 4;
}

struct CodeText {
  std::uint32_t code;
  const char* text;
};

// Table 22, in our own words.
constexpr std::array<CodeText, 31> kAborts = {{
    {0x0503'0000, "toggle bit not alternated"},
    {0x0504'0000, "SDO protocol timed out"},
    {0x0504'0001, "command specifier not valid or unknown"},
    {0x0504'0002, "invalid block size"},
    {0x0504'0003, "invalid sequence number"},
    {0x0504'0004, "CRC error"},
    {0x0504'0005, "out of memory"},
    {0x0601'0000, "unsupported access to an object"},
    {0x0601'0001, "attempt to read a write-only object"},
    {0x0601'0002, "attempt to write a read-only object"},
    {0x0602'0000, "object does not exist"},
    {0x0604'0041, "object cannot be mapped to the PDO"},
    {0x0604'0042, "mapped objects would exceed the PDO length"},
    {0x0604'0043, "parameter incompatibility"},
    {0x0604'0047, "internal incompatibility in the device"},
    {0x0606'0000, "hardware error"},
    {0x0607'0010, "data type or length does not match"},
    {0x0607'0012, "data too long"},
    {0x0607'0013, "data too short"},
    {0x0609'0011, "sub-index does not exist"},
    {0x0609'0030, "invalid value"},
    {0x0609'0031, "value too high"},
    {0x0609'0032, "value too low"},
    {0x0609'0036, "maximum value is less than minimum value"},
    {0x060A'0023, "resource not available"},
    {0x0800'0000, "general error"},
    {0x0800'0020, "data cannot be transferred or stored"},
    {0x0800'0021, "data cannot be stored because of local control"},
    {0x0800'0022, "data cannot be stored in the present device state"},
    {0x0800'0023, "no object dictionary"},
    {0x0800'0024, "no data available"},
}};

struct ErrorClass {
  std::uint8_t first;  // upper byte of the error code
  std::uint8_t last;
  const char* name;
};

// Table 26. The last entry is for all other codes.
constexpr std::array<ErrorClass, 24> kClasses = {{
    {0x00, 0x00, "no error"},
    {0x10, 0x10, "generic"},
    {0x20, 0x20, "current"},
    {0x21, 0x21, "input current"},
    {0x22, 0x22, "current inside"},
    {0x23, 0x23, "output current"},
    {0x30, 0x30, "voltage"},
    {0x31, 0x31, "mains voltage"},
    {0x32, 0x32, "voltage inside"},
    {0x33, 0x33, "output voltage"},
    {0x40, 0x40, "temperature"},
    {0x41, 0x41, "ambient temperature"},
    {0x42, 0x42, "device temperature"},
    {0x50, 0x5F, "hardware"},
    {0x60, 0x6F, "software"},
    {0x70, 0x7F, "additional modules"},
    {0x80, 0x80, "monitoring"},
    {0x81, 0x81, "communication"},
    {0x82, 0x82, "protocol"},
    {0x83, 0x8F, "monitoring"},
    {0x90, 0x9F, "external"},
    {0xF0, 0xFE, "additional functions"},
    {0xFF, 0xFF, "device specific"},
    {0x00, 0xFF, "unknown"},
}};

constexpr std::array<const char*, 8> kRegisterBits = {
    "generic", "current", "voltage", "temperature", "communication", "device profile", "reserved", "manufacturer"};

constexpr std::array<std::pair<NmtState, const char*>, 4> kStates = {
    {{NmtState::kBootUp, "boot_up"},
     {NmtState::kStopped, "stopped"},
     {NmtState::kOperational, "operational"},
     {NmtState::kPreOperational, "pre_operational"}}};

auto FindState(NmtState state) {
  return std::find_if(kStates.begin(), kStates.end(), [state](const auto& known) { return known.first == state; });
}

}  // namespace

// ---- network management ----

CanFrame NmtFrame(NmtCommand command, std::uint8_t node) {
  return {.id = kNmtId, .data = {static_cast<std::uint8_t>(command), node}};
}

std::optional<NmtState> ParseHeartbeat(Bytes data) {
  if (data.size() != 1) return std::nullopt;
  const auto* const known = FindState(static_cast<NmtState>(data[0] & 0x7F));
  return known == kStates.end() ? std::nullopt : std::optional(known->first);
}

const char* NmtStateName(NmtState state) { return FindState(state)->second; }

// ---- service data objects ----

CanFrame RequestFrame(std::uint8_t node, const SdoRequest& request) {
  constexpr auto kRead = static_cast<std::uint8_t>(kUpload << 5);
  constexpr auto kWrite = static_cast<std::uint8_t>(kDownload << 5 | kExpedited | kSizeGiven);
  return SdoFrame(node, request.write ? kWrite : kRead, request.object, request.write.value_or(0));
}

std::optional<SdoRequest> ParseRequest(Bytes data) {
  if (data.size() != kSdoSize) return std::nullopt;
  const unsigned specifier = data[0] >> 5;
  if (specifier == kUpload) return SdoRequest{.object = ObjectOf(data), .write = {}};
  if (specifier != kDownload || (data[0] & kExpedited) == 0) return std::nullopt;
  return SdoRequest{.object = ObjectOf(data), .write = LittleEndian(data, kHeadSize, AnnouncedSize(data[0]))};
}

CanFrame AbortFrame(std::uint8_t node, ObjectId object, AbortCode code) {
  return SdoFrame(node, static_cast<std::uint8_t>(kAbort << 5), object, static_cast<std::uint32_t>(code));
}

const char* AbortText(std::uint32_t code) {
  const auto* found =
      std::find_if(kAborts.begin(), kAborts.end(), [code](const CodeText& abort) { return abort.code == code; });
  return found == kAborts.end() ? "unknown abort code" : found->text;
}

SdoAnswer ParseAnswer(Bytes data) {
  SdoAnswer answer;
  if (data.size() < kHeadSize || data.size() > kSdoSize) return answer;
  const unsigned specifier = data[0] >> 5;
  answer.object = ObjectOf(data);
  if (specifier == kDownloadAnswer) {
    answer.kind = SdoAnswer::Kind::kWritten;
  } else if (specifier == kAbort && data.size() == kSdoSize) {
    answer.kind = SdoAnswer::Kind::kAborted;
    answer.value = LittleEndian(data, kHeadSize, 4);
  } else if (specifier == kUpload && (data[0] & kExpedited) == 0) {
    answer.kind = SdoAnswer::Kind::kSegmented;
    const bool said = (data[0] & kSizeGiven) != 0 && data.size() == kSdoSize;
    answer.value = said ? LittleEndian(data, kHeadSize, 4) : 0;
  } else if (specifier == kUpload && data.size() >= kHeadSize + AnnouncedSize(data[0])) {
    answer.kind = SdoAnswer::Kind::kValue;
    answer.size = AnnouncedSize(data[0]);
    answer.value = LittleEndian(data, kHeadSize, answer.size);
  }
  return answer;
}

// ---- emergency ----

std::optional<Emergency> ParseEmergency(Bytes data) {
  if (data.size() != 8) return std::nullopt;
  Emergency emergency{
      .code = static_cast<std::uint16_t>(LittleEndian(data, 0, 2)), .error_register = data[2], .specific = {}};
  std::copy(data.begin() + 3, data.end(), emergency.specific.begin());
  return emergency;
}

const char* EmergencyClass(std::uint16_t code) {
  const int upper = code >> 8;
  return std::find_if(kClasses.begin(), kClasses.end(),
                      [&](const ErrorClass& known) { return upper >= known.first && upper <= known.last; })
      ->name;
}

std::string ErrorRegisterText(std::uint8_t error_register) {
  std::string text;
  for (std::size_t bit = 0; bit < kRegisterBits.size(); ++bit) {
    if ((error_register >> bit & 1) == 0) continue;
    text += text.empty() ? "" : ", ";
    text += kRegisterBits.at(bit);
  }
  return text.empty() ? "none" : text;
}

}  // namespace axlecast::canopen
