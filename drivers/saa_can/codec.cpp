#include "drivers/saa_can/codec.h"

#include <algorithm>

namespace axlecast::saa_can {

namespace {

// A code of ③: "(00:1M, 02:500K, 03:250K)".
struct BitTiming {
  std::uint8_t code;
  std::int64_t bitrate;
};
constexpr std::array kBitTimings = {BitTiming{0x00, 1'000'000}, BitTiming{0x02, 500'000}, BitTiming{0x03, 250'000}};

CanFrame EightBytes(std::uint32_t id, std::uint8_t d0, std::uint8_t d1, std::uint8_t d2) {
  return {.id = id, .data = {d0, d1, d2, 0, 0, 0, 0, 0}};
}

}  // namespace

Position ParsePosition(Bytes data, const Format& format) {
  const std::size_t size = DataBytes(format.bits);
  if (data.size() < size) return {.error = PositionError::kShort};
  std::uint32_t counts = 0;
  for (std::size_t i = 0; i < size; ++i) {
    counts = counts << 8U | data[format.big_endian ? i : size - 1 - i];
  }
  if (counts >> static_cast<unsigned>(format.bits) != 0) return {.error = PositionError::kRange};
  return {.counts = counts};
}

CanFrame CommandFrame(Command command, std::uint8_t node, std::uint8_t parameter) {
  return EightBytes(RequestId(node), static_cast<std::uint8_t>(command), node, parameter);
}

std::optional<Request> ParseRequest(Bytes data) {
  constexpr std::array kCommands = {Command::kStart, Command::kRead, Command::kZero, Command::kDirection,
                                    Command::kPeriod};
  if (data.size() < 2) return std::nullopt;
  const auto* const command = std::find(kCommands.begin(), kCommands.end(), static_cast<Command>(data[0]));
  if (command == kCommands.end()) return std::nullopt;
  return Request{*command, data[1], data.size() > 2 ? data[2] : std::uint8_t{0}};
}

bool MayAcknowledge(Bytes data, Command command, int bits) {
  if (data.size() < 2 || data[0] != static_cast<std::uint8_t>(command)) return false;
  const Bytes rest = data.subspan(1, std::min(data.size(), DataBytes(bits)) - 1);
  return std::all_of(rest.begin(), rest.end(), [](std::uint8_t byte) { return byte == 0; });
}

CanFrame ServiceFrame(Service service, std::uint8_t d1, std::uint8_t d2) {
  return EightBytes(kConfigureId, static_cast<std::uint8_t>(service), d1, d2);
}

CanFrame ModeFrame(bool configuration) { return ServiceFrame(Service::kMode, configuration ? 1 : 0, 0); }

CanFrame NodeFrame(std::uint8_t node) { return ServiceFrame(Service::kNode, node, 0); }

CanFrame BitrateFrame(std::uint8_t code) { return ServiceFrame(Service::kBitrate, 0, code); }

bool SetsParameter(Bytes data) {
  if (data.empty()) return false;
  const auto service = static_cast<Service>(data[0]);
  return service == Service::kNode || service == Service::kBitrate;
}

std::optional<ServiceReply> ParseServiceReply(Bytes data) {
  if (data.size() < 2 || !SetsParameter(data)) return std::nullopt;
  return ServiceReply{static_cast<Service>(data[0]), data[1]};
}

std::optional<std::uint8_t> BitrateCode(std::int64_t bitrate) {
  const auto* const found = std::find_if(kBitTimings.begin(), kBitTimings.end(),
                                         [&](const auto& timing) { return timing.bitrate == bitrate; });
  return found == kBitTimings.end() ? std::nullopt : std::optional(found->code);
}

std::optional<std::int64_t> BitrateOf(std::uint8_t code) {
  const auto* const found =
      std::find_if(kBitTimings.begin(), kBitTimings.end(), [&](const auto& timing) { return timing.code == code; });
  return found == kBitTimings.end() ? std::nullopt : std::optional(found->bitrate);
}

}  // namespace axlecast::saa_can
