#include "drivers/cia406/node_facts.h"

#include "core/device/operation.h"
#include "drivers/protocol/canopen/canopen.h"

namespace axlecast::cia406 {
namespace {

// Returns whether an object with this many bits shows 2^exponent. If it cannot hold this value, it reads 0 or all ones.
bool IsPower(std::uint32_t value, int exponent, int object_bits) {
  const std::uint64_t power = std::uint64_t{1} << exponent;
  if (exponent < object_bits) return value == power;
  return value == 0 || value == power - 1;
}

Result<> CheckDeviceType(const NodeFacts& facts, const Cia406Settings&) {
  const auto type = facts.Get(kDeviceType);
  if (!type) return Failure("object 1000h cannot be read: no CANopen device by CiA 301; is the node id right?");
  if ((*type & 0xFFFF) == kEncoderProfile) return {};
  return Failure(Text("device type 0x%08X (1000h) is of profile %u, an encoder has 406: is node the encoder's id?",
                      *type, *type & 0xFFFF));
}

Result<> CheckIdentity(const NodeFacts& facts, const Cia406Settings& settings) {
  for (std::size_t part = 0; part < kIdentityParts; ++part) {
    const auto& expected = settings.identity.at(part);
    if (!expected) continue;
    const auto found = facts.Get({kVendor.index, static_cast<std::uint8_t>(kVendor.sub + part)});
    if (found == expected) continue;
    const std::string is = found ? Text("0x%X", *found) : "not offered";
    return Failure(Text("%s (1018h sub %zu) is %s, the file has 0x%X: another encoder, or change identity",
                        kIdentityNames.at(part), part + 1, is.c_str(), *expected));
  }
  return {};
}

Result<> CheckSteps(const char* object, std::optional<std::uint32_t> found, int bits) {
  if (!found || IsPower(*found, bits, 32)) return {};
  return Failure(Text("%s is %u steps a turn, bits: %d means %u: set the encoder or bits right", object, *found,
                      bits, 1U << bits));
}

// Without scaling, the encoder counts with its physical resolution.
Result<> CheckPhysical(const NodeFacts& facts, const Cia406Settings& settings) {
  const auto turns = facts.Get(kPhysicalTurns);
  const bool unknown = !turns || (settings.turn_bits == 0 && *turns == 0);  // a single-turn encoder may show 0
  Result<> steps = CheckSteps("scaling is off, and 6501h", facts.Get(kPhysicalSteps), settings.bits);
  if (!steps || unknown || IsPower(*turns, settings.turn_bits, 16)) return steps;
  return Failure(
      Text("scaling is off, and 6502h is %u turns, turn_bits: %d means %u: set the encoder or turn_bits right",
           *turns, settings.turn_bits, 1U << settings.turn_bits));
}

Result<> CheckScaled(const NodeFacts& facts, const Cia406Settings& settings) {
  const auto range = facts.Get(kTotalRange);
  Result<> steps = CheckSteps("6001h", facts.Get(kUnitsPerTurn), settings.bits);
  if (!steps || !range || IsPower(*range, settings.total_bits(), 32)) return steps;
  return Failure(
      Text("total range 6002h is %u, bits: %d with turn_bits: %d means 2^%d: set the encoder or these right",
           *range, settings.bits, settings.turn_bits, settings.total_bits()));
}

Result<> CheckResolution(const NodeFacts& facts, const Cia406Settings& settings) {
  const auto status = facts.Get(kOperatingStatus);
  const bool physical = status && (*status & kScalingOn) == 0 && facts.Get(kPhysicalSteps);
  Result<> resolution = physical ? CheckPhysical(facts, settings) : CheckScaled(facts, settings);
  if (!resolution || !status) return resolution;
  const bool ccw = (*status & kCounterClockwise) != 0;
  if (ccw == settings.ccw_increases) return {};
  return Failure(Text("6500h shows that it counts up %s, the file has counting: %s: set one of them right",
                      ccw ? "ccw" : "cw", settings.ccw_increases ? "ccw" : "cw"));
}

Result<> CheckTpdo(const NodeFacts& facts, const Cia406Settings& settings) {
  if (settings.mode == Mode::kPolled) return {};
  const std::uint32_t id = facts.Get(kTpdoCobId).value_or(settings.cob_id);
  const std::uint32_t mapped = facts.Get(kTpdoFirst).value_or(kMappedPosition);
  const std::uint32_t type = facts.Get(kTpdoType).value_or(1);
  if ((id & kPdoOff) != 0) {
    return Failure("TPDO1 is switched off (1800h sub 1, bit 31): switch it on, or use mode: sdo");
  }
  if ((id & kPdoIdMask) != settings.cob_id) {
    return Failure(Text("TPDO1 has COB-ID 0x%03X (1800h sub 1), the file expects 0x%03X: set cob_id",
                        id & kPdoIdMask, settings.cob_id));
  }
  if (mapped != kMappedPosition) {
    return Failure(
        Text("TPDO1 begins with 0x%08X (1A00h sub 1), not with the position 0x60040020: map it, or use mode: sdo",
             mapped));
  }
  if (settings.mode == Mode::kSync && type != 1) {
    return Failure(Text(
        "TPDO1 has transmission type %u (1800h sub 2), transmission: sync needs 1: set one of them right", type));
  }
  return {};
}

}  // namespace

Result<> CheckFacts(const NodeFacts& facts, const Cia406Settings& settings) {
  for (const auto check : {CheckDeviceType, CheckIdentity, CheckResolution, CheckTpdo}) {
    if (Result<> result = check(facts, settings); !result) return result;
  }
  return {};
}

}  // namespace axlecast::cia406
