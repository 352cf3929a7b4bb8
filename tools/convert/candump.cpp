#include "tools/convert/candump.h"

#include <array>
#include <cinttypes>
#include <cstdio>

#include "core/messages/message.h"
#include "tools/convert/wire_frames.h"

namespace axlecast {
namespace {

std::string InterfaceName(std::string_view bus) {
  constexpr std::size_t kLongest = 15;  // IFNAMSIZ without its NUL
  std::string name(bus.substr(0, kLongest));
  for (char& c : name) {
    if (c <= ' ' || c > '~') c = '_';
  }
  return name.empty() ? "can" : name;
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

Conversion WriteCandump(const EventRange& events, const Output& out) {
  Conversion done;
  events([&](const LogEvent& event) {
    const auto message = DecodeMessage<wire_t>(event.data);
    if (!message || message->kind != wire_t::KIND_CAN) {
      ++done.left_out;
      return true;
    }
    return VisitRecords(*message, [&](std::int64_t ns, const wire_t& wire, const wire_record_t& record) {
      const std::optional<CanFrame> frame = FrameOnBus(record);
      if (!frame) return true;
      ++done.written;
      return out(CandumpLine(ns, wire.bus, *frame));
    });
  });
  if (done.written == 0) {
    done.problem = "no CAN frame is among these events: a CAN bus with capture: true leaves them in WIRE/<bus>";
  }
  return done;
}

}  // namespace axlecast
