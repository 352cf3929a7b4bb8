#include "tools/convert/pcap.h"

#include <optional>
#include <string>
#include <vector>

#include "core/messages/message.h"
#include "tools/convert/wire_frames.h"
#include "tools/log/log_event.h"

namespace axlecast {
namespace {

using Buffer = std::vector<std::uint8_t>;

constexpr std::uint32_t kMagicNs = 0xA1B2'3C4D;  // in the byte order of the headers, here big-endian
constexpr std::uint32_t kUser0 = 147;
constexpr std::uint32_t kSocketCan = 227;
constexpr std::uint32_t kSnapLength = 65'535;
constexpr std::uint8_t kVersion = 1;

std::string_view Text(const Buffer& bytes) { return {reinterpret_cast<const char*>(bytes.data()), bytes.size()}; }

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
  AppendBigEndian(packet, static_cast<std::uint32_t>(content.size()));  // was on the wire
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
  constexpr std::size_t kLongestName = 24;
  Buffer content = {kVersion, static_cast<std::uint8_t>(message.kind), static_cast<std::uint8_t>(record.direction),
                    static_cast<std::uint8_t>(record.flags)};
  AppendBigEndian(content, static_cast<std::uint32_t>(record.id));
  AppendBigEndian(content, static_cast<std::uint32_t>(record.duration_ns));
  const std::string name = message.bus.substr(0, kLongestName);
  content.push_back(static_cast<std::uint8_t>(name.size()));
  content.insert(content.end(), name.begin(), name.end());
  content.insert(content.end(), record.data.begin(), record.data.end());
  return content;
}

// What the record's packet holds; nothing when it has none.
std::optional<Buffer> Content(const wire_t& message, const wire_record_t& record) {
  if (message.kind != wire_t::KIND_CAN) return LineContent(message, record);
  const std::optional<CanFrame> frame = FrameOnBus(record);
  return frame ? std::optional(CanContent(*frame)) : std::nullopt;
}

// What the captures are of.
struct Kinds {
  bool can = false;
  bool line = false;
};

Kinds Look(const EventRange& events) {
  Kinds kinds;
  events([&](const LogEvent& event) {
    const auto message = DecodeMessage<wire_t>(event.data);
    if (message) (message->kind == wire_t::KIND_CAN ? kinds.can : kinds.line) = true;
    return !kinds.can || !kinds.line;
  });
  return kinds;
}

}  // namespace

Conversion WritePcap(const EventRange& events, const Output& out) {
  Conversion done;
  const Kinds kinds = Look(events);
  if (!kinds.can && !kinds.line) {
    done.problem = "no wire capture is among these events: a bus with capture: true leaves one in WIRE/<bus>";
    return done;
  }
  if (kinds.can && kinds.line) {
    done.problem =
        "these are captures of CAN and of other buses, and a pcap file holds one kind: choose with --channel "
        "'^WIRE/name$'";
    return done;
  }
  if (!out(Text(FileHeader(kinds.can ? kSocketCan : kUser0)))) return done;
  events([&](const LogEvent& event) {
    const auto message = DecodeMessage<wire_t>(event.data);
    if (!message) {
      ++done.left_out;
      return true;
    }
    return VisitRecords(*message, [&](std::int64_t ns, const wire_t& wire, const wire_record_t& record) {
      const std::optional<Buffer> content = Content(wire, record);
      if (!content) return true;
      ++done.written;
      return out(Text(Packet(ns, *content)));
    });
  });
  return done;
}

}  // namespace axlecast
