#include "drivers/tsubaki_sc/decode_data.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "drivers/tsubaki_sc/alarms.h"
#include "drivers/tsubaki_sc/parameters.h"

namespace axlecast::tsubaki_sc {
namespace {

using Json = nlohmann::ordered_json;
using modbus::Function;

constexpr Block kParameterBlock = {Function::kReadHoldingRegisters, 0, 55};
constexpr std::array<Block, 13> kBlocks = {{{Function::kReadCoils, kClearTripCountCoil, 1},
                                            kStopCoil,
                                            {Function::kReadCoils, kStartCoil, 1},
                                            kMains,
                                            kSetValues,
                                            kAnalog,
                                            kStatus,
                                            kLoginStatus,
                                            kParameterBlock,
                                            kLoginBlock,
                                            kPassword,
                                            kProductCode,
                                            kMfgNumber}};

std::uint32_t End(const Block& block) { return std::uint32_t{block.first} + block.count; }

bool Within(const Block& data, const Block& block) {
  return data.read == block.read && data.count > 0 && data.first >= block.first && End(data) <= End(block);
}

bool Overlaps(const Block& data, const Block& block) {
  return data.read == block.read && data.first < End(block) && block.first < End(data);
}

std::uint16_t Word(Bytes registers, std::size_t index) {
  return static_cast<std::uint16_t>((registers[2 * index] << 8) | registers[2 * index + 1]);
}

double Scaled(const Quantity& quantity, std::uint16_t raw) {
  const double value = quantity.is_signed ? static_cast<std::int16_t>(raw) : raw;
  return value / quantity.divisor;
}

// "voltage_v", as the fields of motor_health_t.
std::string Key(const Quantity& quantity) {
  const std::string name(quantity.name);
  if (quantity.unit == "V") return name + "_v";
  if (quantity.unit == "A") return name + "_a";
  if (quantity.unit == "W") return name + "_w";
  return name + (quantity.unit == "degC" ? "_c" : "_mps2");
}

Json AlarmNames(std::uint16_t bits) {
  Json names = Json::array();
  for (const MotorAlarm& alarm : MotorAlarms()) {
    if ((bits & alarm.bit) != 0) names.push_back(alarm.spec.name);
  }
  return names;
}

// ---- one register at its address; false when its value cannot be ----

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
  json[Key(quantity)] = Scaled(quantity, raw);
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

struct Named {
  Block block;
  bool (*add)(Json& json, std::uint16_t address, std::uint16_t raw);
};
constexpr std::array<Named, 5> kNamed = {{{kParameterBlock, AddParameter},
                                          {kSetValues, AddSetValue},
                                          {kAnalog, AddAnalog},
                                          {kStatus, AddStatus},
                                          {kLoginStatus, AddLoginStatus}}};

// ---- blocks of their own ----

// The log that holds the data, in part or whole.
std::optional<Block> LogAround(const Block& data) {
  for (std::size_t log = 0; log < kLogs; ++log) {
    for (std::size_t quantity = 0; quantity < kQuantities; ++quantity) {
      const Block block = LogBlock(log, quantity);
      if (Within(data, block)) return block;
    }
  }
  return std::nullopt;
}

void AddLog(Json& json, const Block& data, const Block& block, Bytes registers) {
  const std::optional<LogPlace> place = LogPlaceOf(block);
  const Quantity& quantity = kQuantityTable.at(place->quantity);
  Json samples = Json::array();
  for (std::size_t i = 0; i < data.count; ++i) samples.push_back(Scaled(quantity, Word(registers, i)));
  json["log"] = place->log + 1;
  json["first_sample"] = data.first - block.first;
  json[Key(quantity)] = std::move(samples);
}

}  // namespace

bool Exists(const Block& data) {
  return std::any_of(kBlocks.begin(), kBlocks.end(), [&](const Block& block) { return Within(data, block); }) ||
         LogAround(data).has_value();
}

bool HoldsSecret(const Block& data) { return Overlaps(data, kLoginBlock) || Overlaps(data, kPassword); }

bool AddRegisters(Json& json, const Block& data, Bytes registers, CharacterOrder order) {
  if (const std::optional<Block> log = LogAround(data)) {
    AddLog(json, data, *log, registers);
    return true;
  }
  if (data == kProductCode) json["product_code"] = RegisterText(registers, order);
  if (data == kMfgNumber) json["mfg_number"] = RegisterText(registers, order);
  for (const Named& named : kNamed) {
    if (!Within(data, named.block)) continue;
    for (std::uint16_t i = 0; i < data.count; ++i) {
      if (!named.add(json, static_cast<std::uint16_t>(data.first + i), Word(registers, i))) return false;
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

}  // namespace axlecast::tsubaki_sc
