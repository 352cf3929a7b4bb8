#include "drivers/saa_serial/family.h"

#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "core/device/operation.h"
#include "drivers/kit/decode.h"
#include "drivers/saa_serial/codec.h"
#include "drivers/saa_serial/settings.h"

namespace axlecast::saa_serial {
namespace {

using Json = nlohmann::ordered_json;

struct Options {
  int bits = 0;  // 0: not given
  std::optional<std::uint8_t> address;
};

// The maker's example (5.1.1 (4)): what a frame of five bytes is taken for if `bits` is not given.
constexpr int kExampleBits = 14;
constexpr int kLargestX = 15;

Result<Options> ReadOptions(const DecodeSettings& settings) {
  Options options;
  const std::array<DecodeOption, 2> known = {
      {NumberOption("bits", options.bits, kMinBits, kMaxBits, "the encoder's resolution"),
       {"address", "X of BX, 0..15, or the whole byte up to 0xfe", [&options](const std::string& value) {
          const std::optional<std::int64_t> number = ParseWhole(value, 0, 0xFE);
          if (!number) return false;
          options.address = static_cast<std::uint8_t>(*number <= kLargestX ? kControlCommand | *number : *number);
          return true;
        }}}};
  if (const Result<> applied = ApplySettings("saa_serial", settings, known); !applied)
    return Failure(applied.error());
  return options;
}

// 5.1.5 (1), 5.1.6 (1). Another command byte than BX and CX may have been ordered from the maker.
Json DescribeRequest(std::uint8_t command) {
  std::string kind = "request";
  if ((command & 0xF0U) == kControlCommand) kind = "read_position_request";
  if ((command & 0xF0U) == kZeroCommand) kind = "zero_request";
  return {{"ok", true}, {"kind", kind}, {"command", HexByte(command)}};
}

const char* RequestErrorWord(std::size_t size) {
  if (size == kRequestSize) return "header";
  return size < kRequestSize ? "short" : "long";
}

const char* ErrorWord(ReplyError error) {
  constexpr std::array kWords = {"checksum", "short", "long", "checksum", "checksum", "wrong_identity", "range"};
  return kWords.at(static_cast<std::size_t>(error));
}

// The resolution of an encoder that sends so many bytes, at most.
int MostBitsOf(std::size_t size) {
  if (size <= ReplySize(16)) return 16;
  return size == ReplySize(24) ? 24 : kMaxBits;
}

Json DescribeReply(Bytes frame, const Options& options) {
  const std::string kind = "position_reply";
  const int usual = frame.size() == ReplySize(kExampleBits) ? kExampleBits : 0;
  const int bits = options.bits != 0 ? options.bits : usual;
  Format format{.bits = bits != 0 ? bits : MostBitsOf(frame.size()), .header = ReplyHeader::kEither};
  // Without an address any is right.
  format.address = options.address.value_or(frame.size() > 1 ? frame[1] : 0);
  const Reply reply = ParseReply(frame, format);
  if (reply.error != ReplyError::kNone) return BadFrame(kind, ErrorWord(reply.error));
  Json json = {{"ok", true}, {"kind", kind}, {"counts", reply.counts}};
  if (bits != 0) json["angle_deg"] = Degrees(reply.counts, format.bits);
  if (reply.header != kFixedHeader) json["address"] = HexByte(reply.header);
  return json;
}

}  // namespace

Result<Json> Decode(const DecodeSettings& settings, Bytes frame) {
  const Result<Options> read = ReadOptions(settings);
  if (!read) return Failure(read.error());
  const Options& options = *read;
  if (frame.empty()) return BadFrame("unknown", "short");
  if (const std::optional<std::uint8_t> command = ParseRequest(frame)) return DescribeRequest(*command);
  if (frame[0] == kRequestStart) return BadFrame("request", RequestErrorWord(frame.size()));
  if (frame[0] == kFrameStart) return DescribeReply(frame, options);
  return BadFrame("unknown", "header");
}

}  // namespace axlecast::saa_serial
