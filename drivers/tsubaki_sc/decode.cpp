#include "drivers/tsubaki_sc/family.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "drivers/kit/arguments.h"
#include "drivers/tsubaki_sc/interpreter.h"
#include "drivers/tsubaki_sc/register_map.h"
#include "drivers/tsubaki_sc/settings.h"

namespace axlecast::tsubaki_sc {
namespace {

using Json = nlohmann::ordered_json;
using modbus::Function;

// ---- what kind of frame it is ----

constexpr std::size_t kFixedSize = 8;  // of a read request, a single write, and the reply to a multiple write
constexpr std::size_t kErrorSize = 5;
constexpr std::size_t kReadData = 3;   // where the data of a read's reply begin
constexpr std::size_t kWriteData = 7;  // and those of a multiple write
constexpr std::size_t kCrc = 2;
constexpr std::size_t kVersionRequestSize = 4;
constexpr std::size_t kVersionReplySize = 6;  // guideline 12: without a byte count
constexpr std::uint8_t kErrorBit = 0x80;

enum class Form : std::uint8_t {
  kUnknown,
  kReadRequest,
  kReadReply,
  kSingleWrite,  // request and reply are the same bytes
  kMultipleWrite,
  kMultipleReply,
  kVersionRequest,
  kVersionReply,
  kError
};

// The kind of a frame, by its function and length alone (guideline 4 to 6, 12).
struct Shape {
  Form form = Form::kUnknown;
  std::string kind = "unknown";
  std::size_t size = 0;  // that it must have
  Function space{};      // which addresses, by the function that reads them

  [[nodiscard]] bool is_write() const { return form == Form::kSingleWrite || form == Form::kMultipleWrite; }
  [[nodiscard]] bool is_request() const {  // a single write counts as one
    return is_write() || form == Form::kReadRequest || form == Form::kVersionRequest;
  }
  [[nodiscard]] bool is_bits() const {
    return space == Function::kReadCoils || space == Function::kReadDiscreteInputs;
  }
};

// Request and reply of a read can be distinguished because no reply has a request's 8 bytes: registers have an even
// number of bytes, and no two bits have consecutive addresses.
Shape ReadShape(Bytes frame, const char* name) {
  const auto function = static_cast<Function>(frame[1]);
  const bool bits = function == Function::kReadCoils || function == Function::kReadDiscreteInputs;
  const std::size_t bytes = frame.size() > 2 ? frame[2] : 0;
  const bool reply = frame.size() != kFixedSize && (bits ? bytes == 1 : bytes > 0 && bytes % 2 == 0);
  if (reply) return {Form::kReadReply, std::string(name) + "_reply", kReadData + bytes + kCrc, function};
  return {Form::kReadRequest, std::string(name) + "_request", kFixedSize, function};
}

Shape MultipleShape(Bytes frame, const char* name, Function space) {
  if (frame.size() == kFixedSize) return {Form::kMultipleReply, std::string(name) + "_reply", kFixedSize, space};
  const std::size_t bytes = frame.size() < kWriteData ? 1 : frame[kWriteData - 1];
  return {Form::kMultipleWrite, std::string(name) + "_request", kWriteData + bytes + kCrc, space};
}

// Precondition: at least 2 bytes.
Shape ShapeOf(Bytes frame) {
  if ((frame[1] & kErrorBit) != 0) return {Form::kError, "error_reply", kErrorSize, {}};
  switch (static_cast<Function>(frame[1])) {
    case Function::kReadCoils:
      return ReadShape(frame, "read_coils");
    case Function::kReadDiscreteInputs:
      return ReadShape(frame, "read_input_status");
    case Function::kReadHoldingRegisters:
      return ReadShape(frame, "read_holding_registers");
    case Function::kReadInputRegisters:
      return ReadShape(frame, "read_input_registers");
    case Function::kWriteCoil:
      return {Form::kSingleWrite, "write_coil_request_or_reply", kFixedSize, Function::kReadCoils};
    case Function::kWriteRegister:
      return {Form::kSingleWrite, "write_register_request_or_reply", kFixedSize, Function::kReadHoldingRegisters};
    case Function::kWriteCoils:
      return MultipleShape(frame, "write_coils", Function::kReadCoils);
    case Function::kWriteRegisters:
      return MultipleShape(frame, "write_registers", Function::kReadHoldingRegisters);
    case Function::kReportServerId:
      if (frame.size() <= kVersionRequestSize) {
        return {Form::kVersionRequest, "report_slave_id_request", kVersionRequestSize, {}};
      }
      return {Form::kVersionReply, "report_slave_id_reply", kVersionReplySize, {}};
  }
  return {};
}

// ---- names for the data at consecutive addresses ----

bool Overlaps(const Block& data, const Block& block) {
  return data.read == block.read && data.first < block.end() && block.first < data.end();
}

std::uint16_t Word(Bytes bytes, std::size_t at) {
  return static_cast<std::uint16_t>((bytes[at] << 8) | bytes[at + 1]);
}

Json AlarmNames(std::uint16_t bits) {
  Json names = Json::array();
  for (const MotorAlarm& alarm : MotorAlarms()) {
    if ((bits & alarm.bit) != 0) names.push_back(alarm.spec.name);
  }
  return names;
}

// ---- one register at its address; false if its value is impossible ----

bool AddParameter(Json& json, std::uint16_t address, std::uint16_t raw) {
  const ParameterSpec& parameter = Parameters()[address];
  if (raw < parameter.min || raw > parameter.max) return false;
  json[std::string(parameter.name)] = raw / std::pow(10, parameter.decimals);
  return true;
}

// Guideline 10, AI 0-8: 0.1 W and 0.1 s.
bool AddSetValue(Json& json, std::uint16_t address, std::uint16_t raw) {
  constexpr std::array<const char*, 9> kNames = {
      "set_power_upper_a",      "set_power_upper_b",      "set_power_lower_a",
      "set_power_lower_b",      "set_start_time",         "set_shock_time_upper_a",
      "set_shock_time_upper_b", "set_shock_time_lower_a", "set_shock_time_lower_b"};
  json[kNames.at(address)] = raw / 10.0;
  return true;
}

bool AddAnalog(Json& json, std::uint16_t address, std::uint16_t raw) {
  const Quantity& quantity = kQuantityTable.at(static_cast<std::size_t>(address - kAnalog.first));
  json[quantity.key] = ToUnits(quantity, raw);
  return true;
}

bool AddStatus(Json& json, std::uint16_t address, std::uint16_t raw) {
  const int place = address - kStatus.first;
  if (place == 0) {
    json["trip_count"] = raw;
  } else if (place == 1) {
    json["motor_status"] = raw;
    json["alarms"] = AlarmNames(raw);
  } else {
    json["trip_factor_" + std::to_string(place - 1)] = AlarmNames(raw);
  }
  return true;
}

bool AddLoginStatus(Json& json, std::uint16_t, std::uint16_t raw) {
  json["logged_in"] = raw == kSaysLoggedIn;
  return raw == kSaysLoggedIn || raw == kSaysLoggedOut;
}

// The data addresses of the unit except its logs, with the function that adds one register; null: none.
struct NamedBlock {
  Block block;
  bool (*add)(Json& json, std::uint16_t address, std::uint16_t raw);
};
constexpr std::array<NamedBlock, 13> kBlocks = {{{{Function::kReadCoils, kClearTripCountCoil, 1}, nullptr},
                                                 {kStopCoil, nullptr},
                                                 {{Function::kReadCoils, kStartCoil, 1}, nullptr},
                                                 {kMains, nullptr},
                                                 {kSetValues, AddSetValue},
                                                 {kAnalog, AddAnalog},
                                                 {kStatus, AddStatus},
                                                 {kLoginStatus, AddLoginStatus},
                                                 {{Function::kReadHoldingRegisters, 0, 55}, AddParameter},
                                                 {kLoginBlock, nullptr},
                                                 {kPassword, nullptr},
                                                 {kProductCode, nullptr},
                                                 {kMfgNumber, nullptr}}};

// ---- the data of a frame ----

void AddLog(Json& json, const LogPlace& place, const Block& data, Bytes registers) {
  const Quantity& quantity = kQuantityTable.at(place.quantity);
  Json samples = Json::array();
  for (std::size_t i = 0; i < data.count; ++i) samples.push_back(ToUnits(quantity, Word(registers, 2 * i)));
  json["log"] = place.log + 1;
  json["first_sample"] = data.first - LogBlock(place.log, place.quantity).first;
  json[quantity.key] = std::move(samples);
}

bool Exists(const Block& data) {
  return LogHolding(data) || std::any_of(kBlocks.begin(), kBlocks.end(),
                                         [&](const NamedBlock& known) { return known.block.Holds(data); });
}

bool HoldsSecret(const Block& data) { return Overlaps(data, kLoginBlock) || Overlaps(data, kPassword); }

bool AddRegisters(Json& json, const Block& data, Bytes registers, CharacterOrder order) {
  if (const std::optional<LogPlace> log = LogHolding(data)) {
    AddLog(json, *log, data, registers);
    return true;
  }
  if (data == kProductCode) json["product_code"] = RegisterText(registers, order);
  if (data == kMfgNumber) json["mfg_number"] = RegisterText(registers, order);
  for (const NamedBlock& known : kBlocks) {
    if (known.add == nullptr || !known.block.Holds(data)) continue;
    for (std::uint16_t i = 0; i < data.count; ++i) {
      if (!known.add(json, static_cast<std::uint16_t>(data.first + i), Word(registers, 2 * i))) return false;
    }
  }
  return true;
}

void AddBit(Json& json, const Block& data, bool on) {
  if (data.read == Function::kReadDiscreteInputs) {
    json["mains_hz"] = on ? 60 : 50;
  } else {
    json["coil"] = data.first == kStopCoilAddress ? "stop"
                   : data.first == kStartCoil     ? "start"
                                                  : "clear_trip_count";
    json["on"] = on;
  }
}

struct Options {
  std::optional<std::uint16_t> start;
  std::vector<std::uint8_t> request;  // empty: unknown
  CharacterOrder order = CharacterOrder::kHighFirst;
};

// ---- settings ----

// Returns whether the frame is a complete and correct request.
bool IsRequest(Bytes frame) {
  if (!modbus::IsSealed(frame)) return false;
  const Shape shape = ShapeOf(frame);
  return shape.is_request() && frame.size() == shape.size;
}

// A wrong request is not repeated in the error: it may hold a password.
Result<> SetOption(const std::string& key, const std::string& value, Options& options) {
  if (key == "start") {
    const std::optional<std::int64_t> start = ParseWhole(value, 0, UINT16_MAX);
    if (!start) {
      return Failure("start=" + value + ": expected 0..65535 or 0x0..0xffff, the first address that was read");
    }
    options.start = static_cast<std::uint16_t>(*start);
    options.request.clear();
  } else if (key == "request") {
    const std::optional<std::vector<std::uint8_t>> request = ParseHex(value);
    if (!request || !IsRequest(*request)) {
      return Failure("request=: expected a whole request in hex, with a right CRC");
    }
    options.request = *request;
    options.start.reset();
  } else if (key == "endian") {
    if (value != "high" && value != "low") return Failure(key + "=" + value + ": expected high or low");
    options.order = value == "low" ? CharacterOrder::kLowFirst : CharacterOrder::kHighFirst;
  } else {
    return Failure("unknown key '" + key + "': tsubaki_sc knows start, request and endian");
  }
  return {};
}

// ---- its content ----

Json Bad(const Shape& shape, const char* error) { return {{"ok", false}, {"kind", shape.kind}, {"error", error}}; }
Json Good(const Shape& shape, Bytes frame) { return {{"ok", true}, {"kind", shape.kind}, {"address", frame[0]}}; }

void AddRaw(Json& json, Bytes registers) {
  Json raw = Json::array();
  for (std::size_t i = 0; i + 1 < registers.size(); i += 2) raw.push_back(Word(registers, i));
  json["registers"] = std::move(raw);
}

// Decodes data at a known address: `bit` for coils and inputs, else `registers`.
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

// Decodes a reply to a read whose addresses are not known.
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

Result<Json> Decode(const DecodeSettings& settings, Bytes frame) {
  Options options;
  for (const auto& [key, value] : settings) {
    if (const Result<> set = SetOption(key, value, options); !set) return Failure(set.error());
  }
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
