#include "tools/convert/conversion.h"

#include <algorithm>
#include <array>
#include <axlecast/wire_t.hpp>
#include <cinttypes>
#include <cstdio>
#include <optional>
#include <vector>

#include "core/base/time.h"
#include "core/messages/message.h"
#include "tools/log/log_event.h"

namespace axlecast {
namespace {

// Returns the frame of a record that was on the bus: received, or sent and confirmed.
std::optional<CanFrame> FrameOnBus(const wire_record_t& record) {
  switch (record.direction) {
    case wire_record_t::DIRECTION_RECEIVE:
    case wire_record_t::DIRECTION_STRAY:
    case wire_record_t::DIRECTION_CONFIRMED:
      break;
    default:
      return std::nullopt;
  }
  if (record.data.size() > kMaxCanData) return std::nullopt;
  return CanFrame{.id = static_cast<std::uint32_t>(record.id), .data = InlineBytes<kMaxCanData>(record.data)};
}

std::string InterfaceName(std::string_view bus) {
  constexpr std::size_t kMaxLength = 15;  // IFNAMSIZ without its NUL
  std::string name(bus.substr(0, kMaxLength));
  for (char& c : name) {
    if (c <= ' ' || c > '~') c = '_';
  }
  return name.empty() ? "can" : name;
}

using Buffer = std::vector<std::uint8_t>;

constexpr std::uint32_t kMagicNs = 0xA1B2'3C4D;  // in the byte order of the headers, here big-endian
constexpr std::uint32_t kUser0 = 147;
constexpr std::uint32_t kSocketCan = 227;
constexpr std::uint32_t kSnapLength = 65'535;
constexpr std::uint8_t kVersion = 1;

Buffer FileHeader(std::uint32_t link_type) {
  Buffer header;
  AppendBigEndian(header, kMagicNs);
  AppendBigEndian(header, std::uint16_t{2});  // version 2.4
  AppendBigEndian(header, std::uint16_t{4});
  AppendBigEndian(header, std::uint64_t{0});  // reserved
  AppendBigEndian(header, kSnapLength);
  AppendBigEndian(header, link_type);
  return header;
}

Buffer Packet(std::int64_t ns, const Buffer& content) {
  constexpr std::int64_t kNsPerSecond = 1'000'000'000;
  Buffer packet;
  AppendBigEndian(packet, static_cast<std::uint32_t>(ns / kNsPerSecond));
  AppendBigEndian(packet, static_cast<std::uint32_t>(ns % kNsPerSecond));
  AppendBigEndian(packet, static_cast<std::uint32_t>(content.size()));  // captured
  AppendBigEndian(packet, static_cast<std::uint32_t>(content.size()));  // on the wire
  packet.insert(packet.end(), content.begin(), content.end());
  return packet;
}

Buffer CanContent(const CanFrame& frame) {
  const Bytes data = frame.data;
  Buffer content;
  AppendBigEndian(content, frame.id);
  content.push_back(static_cast<std::uint8_t>(data.size()));
  content.insert(content.end(), 3, 0);  // FD flags, reserved
  content.insert(content.end(), data.begin(), data.end());
  return content;
}

Buffer LineContent(const wire_t& message, const wire_record_t& record) {
  constexpr std::size_t kMaxNameLength = 24;
  Buffer content = {kVersion, static_cast<std::uint8_t>(message.kind), static_cast<std::uint8_t>(record.direction),
                    static_cast<std::uint8_t>(record.flags)};
  AppendBigEndian(content, static_cast<std::uint32_t>(record.id));
  AppendBigEndian(content, static_cast<std::uint32_t>(record.duration_ns));
  const std::string name = message.bus.substr(0, kMaxNameLength);
  content.push_back(static_cast<std::uint8_t>(name.size()));
  content.insert(content.end(), name.begin(), name.end());
  content.insert(content.end(), record.data.begin(), record.data.end());
  return content;
}

// Returns the content of the record's packet; nothing if the record has no packet.
std::optional<Buffer> Content(const wire_t& message, const wire_record_t& record) {
  if (message.kind != wire_t::KIND_CAN) return LineContent(message, record);
  const std::optional<CanFrame> frame = FrameOnBus(record);
  return frame ? std::optional(CanContent(*frame)) : std::nullopt;
}

struct CaptureKinds {
  bool can = false;
  bool line = false;
};

CaptureKinds FindKinds(const EventRange& events) {
  CaptureKinds kinds;
  events([&](const LogEvent& event) {
    const auto message = DecodeMessage<wire_t>(event.data);
    if (message) (message->kind == wire_t::KIND_CAN ? kinds.can : kinds.line) = true;
    return !kinds.can || !kinds.line;
  });
  return kinds;
}

// Writes the text that format(ns, message, record) returns for each record of the captures; nothing for a record without a text.
// `only_can`: leaves out captures of other buses.
template <typename Format>
Conversion WriteRecords(const EventRange& events, bool only_can, const Output& out, const Format& format) {
  constexpr std::int64_t kLatestUs = INT64_MAX / kMicrosecond / 2;
  Conversion done;
  events([&](const LogEvent& event) {
    const auto message = DecodeMessage<wire_t>(event.data);
    if (!message || (only_can && message->kind != wire_t::KIND_CAN)) {
      ++done.left_out;
      return true;
    }
    const std::int64_t start = std::clamp(message->utime, std::int64_t{0}, kLatestUs) * kMicrosecond;
    return std::all_of(message->records.begin(), message->records.end(), [&](const wire_record_t& record) {
      const std::int64_t ns = std::max(std::int64_t{0}, start + record.dt_ns);
      const std::optional<std::string> text = format(ns, *message, record);
      if (!text) return true;
      ++done.written;
      return out(*text);
    });
  });
  return done;
}

}  // namespace

std::string CandumpLine(std::int64_t ns, std::string_view interface, const CanFrame& frame) {
  constexpr std::int64_t kNsPerSecond = 1'000'000'000;
  std::array<char, 48> text{};
  static_cast<void>(std::snprintf(text.data(), text.size(), "(%010" PRId64 ".%06" PRId64 ") ", ns / kNsPerSecond,
                                  ns % kNsPerSecond / 1'000));
  std::string line = text.data() + InterfaceName(interface);
  const bool long_id = (frame.id & (kCanExtended | kCanError)) != 0;
  const std::uint32_t id = frame.id & (long_id ? kCanExtendedMask | (frame.id & kCanError) : kCanStandardMask);
  static_cast<void>(std::snprintf(text.data(), text.size(), long_id ? " %08" PRIX32 "#" : " %03" PRIX32 "#", id));
  line += text.data();
  if ((frame.id & kCanRemote) != 0 && (frame.id & kCanError) == 0) return line + "R\n";
  for (const std::uint8_t byte : Bytes(frame.data)) {
    static_cast<void>(std::snprintf(text.data(), text.size(), "%02X", byte));
    line += text.data();
  }
  return line + '\n';
}

Result<Conversion> WriteCandump(const EventRange& events, const Output& out) {
  Conversion done = WriteRecords(
      events, true, out,
      [](std::int64_t ns, const wire_t& message, const wire_record_t& record) -> std::optional<std::string> {
        const std::optional<CanFrame> frame = FrameOnBus(record);
        return frame ? std::optional(CandumpLine(ns, message.bus, *frame)) : std::nullopt;
      });
  if (done.written == 0) {
    return Failure("the selected events contain no CAN frame: set capture: true on a CAN bus to record WIRE/<bus>");
  }
  return done;
}

Result<Conversion> WritePcap(const EventRange& events, const Output& out) {
  const CaptureKinds kinds = FindKinds(events);
  if (!kinds.can && !kinds.line) {
    return Failure("the selected events contain no wire capture: set capture: true on a bus to record WIRE/<bus>");
  }
  if (kinds.can && kinds.line) {
    return Failure(
        "the selected events contain captures of CAN and of other buses, but a pcap file contains one kind: choose "
        "with --channel '^WIRE/name$'");
  }
  if (!out(AsText(FileHeader(kinds.can ? kSocketCan : kUser0)))) return Conversion();
  return WriteRecords(
      events, false, out,
      [](std::int64_t ns, const wire_t& message, const wire_record_t& record) -> std::optional<std::string> {
        const std::optional<Buffer> content = Content(message, record);
        return content ? std::optional(std::string(AsText(Packet(ns, *content)))) : std::nullopt;
      });
}

}  // namespace axlecast
