#include "drivers/saa_modbus/family.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "drivers/kit/decode.h"
#include "drivers/protocol/modbus/adu.h"
#include "drivers/saa_modbus/codec.h"

namespace axlecast::saa_modbus {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::uint8_t kException = kReadPosition | 0x80;
constexpr std::size_t kQuerySize = 4;
constexpr std::size_t kSetAddressReplySize = 4;
constexpr std::size_t kReadRequestSize = 8;
constexpr std::size_t kShortSize = 5;

struct Shape {
  const char* kind = "unknown";
  std::size_t size = 0;
};

// By function and, where request and reply differ in it alone, by length or the third byte: a read begins at
// register 0, a reply holds 2 to 4 bytes.
Shape ShapeOf(Bytes frame) {
  switch (frame[1]) {
    case kReadPosition:
      if (frame.size() < 3 || frame[2] == 0) return {"read_position_request", kReadRequestSize};
      return {"read_position_reply", kShortSize + frame[2]};
    case kException:
      return {"read_position_exception", kShortSize};
    case kQueryAddress:
      if (frame.size() <= kQuerySize) return {"query_address_request", kQuerySize};
      return {"query_address_reply", kShortSize};
    case kSetAddress:
      if (frame.size() <= kSetAddressReplySize) return {"set_address_reply", kSetAddressReplySize};
      return {"set_address_request", kShortSize};
    case kSetParameter:
      return {"set_parameter_request_or_reply", kShortSize};
    default:
      return {};
  }
}

std::string ParameterName(Parameter parameter) {
  if (const std::optional<std::int64_t> baud = BaudOf(parameter)) return "baud_" + std::to_string(*baud);
  if (parameter == Parameter::kZero) return "zero";
  return parameter == Parameter::kPositive ? "positive" : "negative";
}

Json DescribeRequest(const char* kind, const Request& request) {
  Json json = {{"ok", true}, {"kind", kind}};
  if (request.function != kQueryAddress) json["address"] = request.address;
  if (request.function == kReadPosition) json["registers"] = request.registers;
  if (request.function == kSetAddress) json["new_address"] = request.new_address;
  if (request.function == kSetParameter) json["parameter"] = ParameterName(request.parameter);
  return json;
}

Json DescribePosition(const char* kind, Bytes frame, int bits) {
  if (bits > 8 * frame[2]) return BadFrame(kind, "range");  // no position of this encoder
  const int registers = frame[2] == 2 ? 1 : 2;
  Request asked{.address = frame[0], .registers = static_cast<std::uint8_t>(registers)};
  // A reply of three bytes is one of 17 to 24 bits.
  const Reply reply = Check(asked, frame, bits > 0 ? bits : std::min(8 * int{frame[2]}, kMaxBits));
  if (reply.error) return BadFrame(kind, "range");
  Json json = {{"ok", true}, {"kind", kind}, {"address", frame[0]}, {"counts", reply.counts}};
  if (bits > 0) json["angle_deg"] = std::ldexp(360.0 * reply.counts, -bits);
  return json;
}

Json Describe(const Shape& shape, Bytes frame, int bits) {
  if (const std::optional<Request> request = ParseRequest(frame)) return DescribeRequest(shape.kind, *request);
  // A query and its reply begin with FF.
  if (frame[1] != kQueryAddress && (frame[0] < kMinAddress || frame[0] > kMaxAddress))
    return BadFrame(shape.kind, "range");
  switch (frame[1]) {
    case kReadPosition:
      if (shape.size == kReadRequestSize && frame[2] == 0) return BadFrame(shape.kind, "range");
      return DescribePosition(shape.kind, frame, bits);
    case kException:
      return {{"ok", true}, {"kind", shape.kind}, {"address", frame[0]}, {"exception", frame[2]}};
    case kQueryAddress: {
      const Reply reply = Check({.function = kQueryAddress, .address = kEveryone}, frame, kMaxBits);
      if (reply.error) return BadFrame(shape.kind, "range");
      return {{"ok", true}, {"kind", shape.kind}, {"address", reply.address}};
    }
    case kSetAddress:
      if (frame.size() != kSetAddressReplySize) return BadFrame(shape.kind, "range");
      return {{"ok", true}, {"kind", shape.kind}, {"address", frame[0]}};
    default:
      return BadFrame(shape.kind, "range");
  }
}

}  // namespace

Result<Json> Decode(const DecodeSettings& settings, Bytes frame) {
  int bits = 0;
  const std::vector options = {NumberOption("bits", bits, kMinBits, kMaxBits, "the resolution")};
  if (const Result<> set = ApplySettings("saa_modbus", settings, options); !set) return Failure(set.error());
  if (frame.size() < 2) return BadFrame("unknown", "short");
  const Shape shape = ShapeOf(frame);
  if (shape.size == 0) return BadFrame(shape.kind, "function");
  if (frame.size() < shape.size) return BadFrame(shape.kind, "short");
  if (frame.size() > shape.size) return BadFrame(shape.kind, "long");
  const bool query_reply = frame[1] == kQueryAddress && frame.size() == kShortSize;
  if (query_reply ? !IsSealedEitherWay(frame) : !modbus::IsSealed(frame)) return BadFrame(shape.kind, "checksum");
  return Describe(shape, frame, bits);
}

}  // namespace axlecast::saa_modbus
