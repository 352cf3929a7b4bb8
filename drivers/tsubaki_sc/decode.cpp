#include "drivers/tsubaki_sc/decode.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "drivers/kit/arguments.h"
#include "drivers/protocol/modbus/adu.h"
#include "drivers/tsubaki_sc/decode_data.h"
#include "drivers/tsubaki_sc/decode_shape.h"
#include "drivers/tsubaki_sc/settings.h"

namespace axlecast::tsubaki_sc {
namespace {

using Json = nlohmann::ordered_json;
using modbus::Function;
using Form = Shape::Form;

constexpr std::uint8_t kErrorBit = 0x80;
constexpr std::size_t kReadData = 3;   // where the data of a read's reply begin
constexpr std::size_t kWriteData = 7;  // and those of a multiple write

struct Options {
  std::optional<std::uint16_t> start;
  std::vector<std::uint8_t> request;  // empty: unknown
  CharacterOrder order = CharacterOrder::kHighFirst;
};

std::uint16_t Word(Bytes bytes, std::size_t at) {
  return static_cast<std::uint16_t>((bytes[at] << 8) | bytes[at + 1]);
}

// ---- settings ----

// A request that is whole and right in itself.
bool IsRequest(Bytes frame) {
  if (!modbus::IsSealed(frame)) return false;
  const Shape shape = ShapeOf(frame);
  return shape.is_request() && frame.size() == shape.size;
}

// Empty when taken up. A wrong request is not repeated: it may hold a password.
std::string SetOption(const std::string& key, const std::string& value, Options& options) {
  if (key == "start") {
    const std::optional<std::int64_t> start = ParseWhole(value, 0, UINT16_MAX);
    if (!start) return "start=" + value + ": expected 0..65535 or 0x0..0xffff, the first address that was read";
    options.start = static_cast<std::uint16_t>(*start);
    options.request.clear();
  } else if (key == "request") {
    const std::optional<std::vector<std::uint8_t>> request = ParseHex(value);
    if (!request || !IsRequest(*request)) return "request=: expected a whole request in hex, with a right CRC";
    options.request = *request;
    options.start.reset();
  } else if (key == "endian") {
    if (value != "high" && value != "low") return key + "=" + value + ": expected high or low";
    options.order = value == "low" ? CharacterOrder::kLowFirst : CharacterOrder::kHighFirst;
  } else {
    return "unknown key '" + key + "': tsubaki_sc knows start, request and endian";
  }
  return {};
}

// ---- what it says ----

Json Bad(const Shape& shape, const char* error) { return {{"ok", false}, {"kind", shape.kind}, {"error", error}}; }
Json Good(const Shape& shape, Bytes frame) { return {{"ok", true}, {"kind", shape.kind}, {"address", frame[0]}}; }

void AddRaw(Json& json, Bytes registers) {
  Json raw = Json::array();
  for (std::size_t i = 0; i + 1 < registers.size(); i += 2) raw.push_back(Word(registers, i));
  json["registers"] = std::move(raw);
}

// What stands at a known place: `bit` of coils and inputs, else `registers`.
Json DescribeData(const Shape& shape, Bytes frame, const Block& place, bool bit, Bytes registers,
                  CharacterOrder order) {
  if (!Exists(place)) return Bad(shape, "range");
  Json json = Good(shape, frame);
  json["start"] = place.first;
  json["count"] = place.count;
  if (shape.is_bits()) {
    AddBit(json, place, bit);
    return json;
  }
  if (HoldsSecret(place)) {
    json["masked"] = true;
    return json;
  }
  AddRaw(json, registers);
  return AddRegisters(json, place, registers, order) ? json : Bad(shape, "range");
}

// A read's reply without a hint where its data stand.
Json DescribeAnywhere(const Shape& shape, Bytes frame, Bytes data) {
  Json json = Good(shape, frame);
  if (shape.space == Function::kReadDiscreteInputs) {
    AddBit(json, kMains, data[0] == 1);  // there is one input only
  } else if (shape.is_bits()) {
    json["on"] = data[0] == 1;
  } else if (shape.space == Function::kReadHoldingRegisters && data.size() == std::size_t{2} * kPassword.count) {
    json["masked"] = true;
  } else {
    AddRaw(json, data);
  }
  return json;
}

Json DescribeReadReply(const Shape& shape, Bytes frame, const Options& options) {
  const Bytes data = frame.subspan(kReadData, frame[kReadData - 1]);
  if (shape.is_bits() && data[0] > 1) return Bad(shape, "range");
  if (options.request.empty() && !options.start) return DescribeAnywhere(shape, frame, data);
  const std::uint16_t start = options.start ? *options.start : Word(options.request, 2);
  const auto count = static_cast<std::uint16_t>(shape.is_bits() ? 1 : data.size() / 2);
  return DescribeData(shape, frame, {shape.space, start, count}, data[0] == 1, data, options.order);
}

Json DescribeSingleWrite(const Shape& shape, Bytes frame, CharacterOrder order) {
  const std::uint16_t value = Word(frame, 4);
  if (shape.is_bits() && value != modbus::kCoilOn && value != modbus::kCoilOff) return Bad(shape, "range");
  const Block place = {shape.space, Word(frame, 2), 1};
  return DescribeData(shape, frame, place, value == modbus::kCoilOn, frame.subspan(4, 2), order);
}

Json DescribeMultipleWrite(const Shape& shape, Bytes frame, CharacterOrder order) {
  const Block place = {shape.space, Word(frame, 2), Word(frame, 4)};
  const Bytes data = frame.subspan(kWriteData, frame[kWriteData - 1]);
  if (data.size() != (shape.is_bits() ? 1 : std::size_t{2} * place.count)) return Bad(shape, "range");
  return DescribeData(shape, frame, place, (data[0] & 1U) != 0, data, order);
}

Json Describe(const Shape& shape, Bytes frame, const Options& options) {
  Json json = Good(shape, frame);
  switch (shape.form) {
    case Form::kReadReply:
      return DescribeReadReply(shape, frame, options);
    case Form::kSingleWrite:
      return DescribeSingleWrite(shape, frame, options.order);
    case Form::kMultipleWrite:
      return DescribeMultipleWrite(shape, frame, options.order);
    case Form::kReadRequest:
    case Form::kMultipleReply: {
      const Block place = {shape.space, Word(frame, 2), Word(frame, 4)};
      if (!Exists(place)) return Bad(shape, "range");
      json["start"] = place.first;
      json["count"] = place.count;
      break;
    }
    case Form::kVersionReply:
      json["firmware"] = VersionText(frame.subspan(2, 2));
      break;
    case Form::kError:
      json["function"] = frame[1] & ~unsigned{kErrorBit};
      json["exception"] = frame[2];
      json["exception_text"] = ExceptionName(frame[2]);
      break;
    default:
      break;
  }
  return json;
}

// A reply that cannot be the one to `request`, which is whole.
bool IsWrongEcho(const Shape& shape, Bytes frame, Bytes request) {
  if (shape.is_request() && shape.form != Form::kSingleWrite) return false;
  if (request[0] != frame[0] || request[1] != (frame[1] & ~unsigned{kErrorBit})) return true;
  switch (shape.form) {
    case Form::kSingleWrite:
      return !std::equal(frame.begin(), frame.end(), request.begin(), request.end());
    case Form::kMultipleReply:  // address, function, start and count again
      return !std::equal(frame.begin(), frame.begin() + 6, request.begin());
    case Form::kReadReply:
      return frame[kReadData - 1] != (shape.is_bits() ? 1 : 2 * Word(request, 4));
    default:
      return false;
  }
}

}  // namespace

Json Decode(const DecodeSettings& settings, Bytes frame, bool* usable) {
  Options options;
  std::string problem;
  for (const auto& [key, value] : settings) {
    if (problem.empty()) problem = SetOption(key, value, options);
  }
  *usable = problem.empty();
  if (!*usable) return {{"error", problem}};
  if (frame.size() < 2) return Bad({}, "short");
  const Shape shape = ShapeOf(frame);
  if (shape.form == Form::kUnknown) return Bad(shape, "function");
  if (frame.size() < shape.size) return Bad(shape, "short");
  if (frame.size() > shape.size) return Bad(shape, "long");
  if (!modbus::IsSealed(frame)) return Bad(shape, "checksum");
  const bool broadcast = frame[0] == modbus::kBroadcast && shape.is_write();
  if (frame[0] > kLastAddress || (frame[0] == modbus::kBroadcast && !broadcast)) return Bad(shape, "range");
  if (!options.request.empty() && IsWrongEcho(shape, frame, options.request)) return Bad(shape, "wrong_echo");
  return Describe(shape, frame, options);
}

}  // namespace axlecast::tsubaki_sc
