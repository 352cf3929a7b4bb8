#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "core/base/result.h"
#include "core/device/operation.h"
#include "drivers/cia406/settings.h"
#include "drivers/protocol/canopen/sdo_client.h"

namespace axlecast::cia406 {

// The objects that are read before a node is used (the list is kObjects), as far as they were read.
class NodeFacts {
 public:
  explicit NodeFacts(Mode mode) : mode_(mode) {}

  void Forget() { facts_ = {}; }
  // Returns the object that must be read next; nothing if all were read.
  [[nodiscard]] std::optional<ObjectId> Missing() const {
    for (std::size_t fact = 0; fact < kObjects.size(); ++fact) {
      if (Matters(kObjects.at(fact)) && !facts_.at(fact).read) return kObjects.at(fact);
    }
    return std::nullopt;
  }
  // Receives any transfer of the node. One that timed out is ignored.
  void On(const SdoResult& result) {
    if (result.kind == SdoResult::Kind::kTimedOut || result.request.write) return;
    const auto* found = std::find(kObjects.begin(), kObjects.end(), result.request.object);
    if (found == kObjects.end()) return;
    const bool value = result.kind == SdoResult::Kind::kValue;
    facts_.at(static_cast<std::size_t>(found - kObjects.begin())) = {
        .read = true, .value = value ? std::optional(result.value) : std::nullopt};
  }

  [[nodiscard]] bool complete() const { return !Missing(); }
  // Returns the value of an object of the list; nothing if the node does not offer it, or if it was not read yet.
  [[nodiscard]] std::optional<std::uint32_t> Get(ObjectId object) const {
    const auto* found = std::find(kObjects.begin(), kObjects.end(), object);
    if (found == kObjects.end()) return std::nullopt;
    return facts_.at(static_cast<std::size_t>(found - kObjects.begin())).value;
  }
  // Returns whether TPDO1 is sent after each n-th SYNC.
  [[nodiscard]] bool synchronous() const {
    const auto type = Get(kTpdoType);
    return mode_ == Mode::kSync || (type && *type >= 1 && *type <= kMaxCyclicSync);
  }

 private:
  struct Fact {
    bool read = false;
    std::optional<std::uint32_t> value;
  };
  // In this order: identity, counting, transmission, state.
  static constexpr std::array kObjects = {
      kDeviceType,      kVendor,          kProduct,           kRevision,      kSerial,
      kOperatingStatus, kUnitsPerTurn,    kTotalRange,        kPhysicalSteps, kPhysicalTurns,
      kOffset,          kTpdoCobId,       kTpdoType,          kTpdoTimer,     kTpdoFirst,
      kTpdoSecond,      kSupportedAlarms, kSupportedWarnings, kAlarms,        kWarnings};
  [[nodiscard]] bool Matters(ObjectId object) const {
    const bool of_tpdo = object.index == kTpdoCobId.index || object.index == kTpdoFirst.index;
    return mode_ != Mode::kPolled || !of_tpdo;
  }

  const Mode mode_;
  std::array<Fact, kObjects.size()> facts_{};
};

// ---- the checks of the facts: each error describes what differs, and what to change ----

// Returns whether an object with this many bits shows 2^exponent. If it cannot hold this value, it reads 0 or all ones.
inline bool IsPower(std::uint32_t value, int exponent, int object_bits) {
  const std::uint64_t power = std::uint64_t{1} << exponent;
  if (exponent < object_bits) return value == power;
  return value == 0 || value == power - 1;
}

inline Result<> CheckDeviceType(const NodeFacts& facts, const Cia406Settings&) {
  const auto type = facts.Get(kDeviceType);
  if (!type) return Failure("object 1000h cannot be read: no CANopen device by CiA 301; is the node id right?");
  if ((*type & 0xFFFF) == kEncoderProfile) return {};
  return Failure(Text("device type 0x%08X (1000h) is of profile %u, an encoder has 406: is node the encoder's id?",
                      *type, *type & 0xFFFF));
}

inline Result<> CheckIdentity(const NodeFacts& facts, const Cia406Settings& settings) {
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

inline Result<> CheckSteps(const char* object, std::optional<std::uint32_t> found, int bits) {
  if (!found || IsPower(*found, bits, 32)) return {};
  return Failure(Text("%s is %u steps a turn, bits: %d means %u: set the encoder or bits right", object, *found,
                      bits, 1U << bits));
}

// Without scaling, the encoder counts with its physical resolution.
inline Result<> CheckPhysical(const NodeFacts& facts, const Cia406Settings& settings) {
  const auto turns = facts.Get(kPhysicalTurns);
  const bool unknown = !turns || (settings.turn_bits == 0 && *turns == 0);  // a single-turn encoder may show 0
  Result<> steps = CheckSteps("scaling is off, and 6501h", facts.Get(kPhysicalSteps), settings.bits);
  if (!steps || unknown || IsPower(*turns, settings.turn_bits, 16)) return steps;
  return Failure(
      Text("scaling is off, and 6502h is %u turns, turn_bits: %d means %u: set the encoder or turn_bits right",
           *turns, settings.turn_bits, 1U << settings.turn_bits));
}

inline Result<> CheckScaled(const NodeFacts& facts, const Cia406Settings& settings) {
  const auto range = facts.Get(kTotalRange);
  Result<> steps = CheckSteps("6001h", facts.Get(kUnitsPerTurn), settings.bits);
  if (!steps || !range || IsPower(*range, settings.total_bits(), 32)) return steps;
  return Failure(
      Text("total range 6002h is %u, bits: %d with turn_bits: %d means 2^%d: set the encoder or these right",
           *range, settings.bits, settings.turn_bits, settings.total_bits()));
}

inline Result<> CheckResolution(const NodeFacts& facts, const Cia406Settings& settings) {
  const auto status = facts.Get(kOperatingStatus);
  const bool physical = status && (*status & kScalingOn) == 0 && facts.Get(kPhysicalSteps);
  Result<> resolution = physical ? CheckPhysical(facts, settings) : CheckScaled(facts, settings);
  if (!resolution || !status) return resolution;
  const bool ccw = (*status & kCounterClockwise) != 0;
  if (ccw == settings.ccw_increases) return {};
  return Failure(Text("6500h shows that it counts up %s, the file has counting: %s: set one of them right",
                      ccw ? "ccw" : "cw", settings.ccw_increases ? "ccw" : "cw"));
}

inline Result<> CheckTpdo(const NodeFacts& facts, const Cia406Settings& settings) {
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

// Returns an error if a node with these facts is not the configured encoder.
[[nodiscard]] inline Result<> CheckFacts(const NodeFacts& facts, const Cia406Settings& settings) {
  for (const auto check : {CheckDeviceType, CheckIdentity, CheckResolution, CheckTpdo}) {
    if (Result<> result = check(facts, settings); !result) return result;
  }
  return {};
}

}  // namespace axlecast::cia406
