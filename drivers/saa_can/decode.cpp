#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>

#include "core/base/result.h"
#include "core/device/operation.h"
#include "drivers/cia406/cia406.h"
#include "drivers/kit/decode.h"
#include "drivers/saa_can/codec.h"
#include "drivers/saa_can/family.h"

namespace axlecast::saa_can {
namespace {

using Json = nlohmann::ordered_json;

enum class Taken : std::uint8_t { kEither, kPosition, kReply };

struct Options {
  Format format;  // if none is given, that of the maker's example (5.4.1 (5))
  std::optional<std::uint8_t> node;
  Taken taken = Taken::kEither;  // how to read a frame that may be a position or a reply
};

Result<Options> ReadOptions(const DecodeSettings& settings) {
  Options options;
  const std::array<DecodeOption, 5> known = {
      {NumberOption("bits", options.format.bits, kMinBits, kMaxBits, "the encoder's resolution"),
       NumberOption("node", options.node, kMinNode, kMaxNode, "NN, or 0x01..0xff"),
       ChoiceOption("byte_order", options.format.big_endian, {"little", "big"}),
       {"data", "position or reply",
        [&options](const std::string& value) {
          options.taken = value == "position" ? Taken::kPosition : Taken::kReply;
          return value == "position" || value == "reply";
        }},
       {"model", "saa or cia406", [](const std::string& value) { return value == "saa"; }}}};
  if (const Result<> applied = ApplySettings("saa_can", settings, known); !applied) return Failure(applied.error());
  return options;
}

// The names of the commands: "NAME_request", "NAME_reply".
constexpr std::array<std::pair<Command, const char*>, 5> kNames = {{{Command::kStart, "start"},
                                                                    {Command::kRead, "read_position"},
                                                                    {Command::kZero, "zero"},
                                                                    {Command::kDirection, "set_direction"},
                                                                    {Command::kPeriod, "set_period"}}};

std::string NameOf(Command command) {
  return std::find_if(kNames.begin(), kNames.end(), [&](const auto& name) { return name.first == command; })
      ->second;
}

Json DescribeRequest(std::uint8_t node, Bytes data) {
  if (data.size() < 2) return BadFrame("request", "short");
  const std::optional<Request> request = ParseRequest(data);
  if (!request) return BadFrame("request", "function");
  const std::string kind = NameOf(request->command) + "_request";
  if (request->node != node) return BadFrame(kind, "wrong_identity");
  Json json = {{"ok", true}, {"kind", kind}, {"node", node}};
  if (request->command == Command::kPeriod) json["per_second"] = request->parameter;
  if (request->command == Command::kDirection) json["parameter"] = Text("0x%02x", unsigned{request->parameter});
  return json;
}

Json DescribeData(std::uint8_t node, Bytes data, const Options& options) {
  const Format& format = options.format;
  const auto* const command = std::find_if(kAcknowledged.begin(), kAcknowledged.end(), [&](Command candidate) {
    return MayAcknowledge(data, candidate, format.bits);
  });
  if (command != kAcknowledged.end() && options.taken != Taken::kPosition) {
    const char* prefix = options.taken == Taken::kReply ? "" : "position_or_";
    return {{"ok", true}, {"kind", prefix + NameOf(*command) + "_reply"}, {"node", node}};
  }
  const Position position = ParsePosition(data, format);
  if (position.error != PositionError::kNone) {
    return BadFrame("position", position.error == PositionError::kShort ? "short" : "range");
  }
  return {{"ok", true},
          {"kind", "position"},
          {"node", node},
          {"counts", position.counts},
          {"angle_deg", Degrees(position.counts, format.bits)}};
}

// A reply has no more than its code and 00, and on 7E5 so has the request for 1 Mbit/s.
Json DescribeService(std::uint32_t id, Bytes data) {
  if (data.size() < 2) return BadFrame("service", "short");
  const bool reply_only = id == kConfigureReplyId;
  const std::uint8_t third = data.size() > 2 ? data[2] : std::uint8_t{0};
  switch (static_cast<Service>(data[0])) {
    case Service::kMode:
      if (reply_only || data[1] > 1) return BadFrame("service", "range");
      return {{"ok", true}, {"kind", data[1] == 1 ? "enter_configuration_request" : "leave_configuration_request"}};
    case Service::kNode:
      if (reply_only || data[1] == 0) {
        return {{"ok", true}, {"kind", "set_node_id_reply"}, {"result", data[1]}};
      }
      return {{"ok", true}, {"kind", "set_node_id_request_or_refusal"}, {"new_node", data[1]}};
    case Service::kBitrate:
      break;
    default:
      return BadFrame("service", "function");
  }
  if (reply_only || data[1] != 0) return {{"ok", true}, {"kind", "set_bitrate_reply"}, {"result", data[1]}};
  const std::optional<std::int64_t> bitrate = BitrateOf(third);
  if (!bitrate) return BadFrame("set_bitrate_request", "range");
  return {{"ok", true},
          {"kind", third == 0 ? "set_bitrate_request_or_reply" : "set_bitrate_request"},
          {"bitrate", *bitrate}};
}

Json Describe(const CanFrame& frame, const Options& options) {
  if ((frame.id & ~kCanStandardMask) != 0) return BadFrame("unknown", "header");
  if (frame.id == kConfigureId || frame.id == kConfigureReplyId) return DescribeService(frame.id, frame.data);
  const std::uint32_t base = frame.id & ~kNodeMask;
  const auto node = static_cast<std::uint8_t>(frame.id & kNodeMask);
  if ((base != kDataBase && base != kCommandBase) || node < kMinNode) return BadFrame("unknown", "header");
  const char* kind = base == kDataBase ? "position" : "request";
  if (options.node && options.node != node) return BadFrame(kind, "wrong_identity");
  return base == kDataBase ? DescribeData(node, frame.data, options) : DescribeRequest(node, frame.data);
}

}  // namespace

Result<Json> Decode(const DecodeSettings& settings, Bytes packet) {
  const std::optional<CanFrame> frame = FromPacket(packet);
  const bool standard = std::any_of(settings.begin(), settings.end(), [](const auto& setting) {
    return setting.first == "model" && setting.second == cia406::kModel;
  });
  if (standard) {
    Result<Json> json = cia406::Decode(settings, frame.value_or(CanFrame{}));
    if (frame || !json) return json;
  } else {
    const Result<Options> options = ReadOptions(settings);
    if (!options) return Failure(options.error());
    if (frame) return Describe(*frame, *options);
  }
  return BadFrame("unknown", packet.size() < 4 ? "short" : "long");
}

}  // namespace axlecast::saa_can
