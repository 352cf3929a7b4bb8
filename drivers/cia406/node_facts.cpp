#include "drivers/cia406/node_facts.h"

#include <algorithm>

#include "core/device/operation.h"
#include "drivers/protocol/canopen/canopen.h"

namespace axlecast::cia406 {
namespace {

// In this order: who it is, how it counts, how it sends, how it is.
constexpr std::array kObjects = {
    kDeviceType,      kVendor,          kProduct,           kRevision,      kSerial,
    kOperatingStatus, kUnitsPerTurn,    kTotalRange,        kPhysicalSteps, kPhysicalTurns,
    kOffset,          kTpdoCobId,       kTpdoType,          kTpdoTimer,     kTpdoFirst,
    kTpdoSecond,      kSupportedAlarms, kSupportedWarnings, kAlarms,        kWarnings};

// Of 2^exponent, as an object of so many bits shows it: the highest value that it cannot hold reads 0, or all ones.
bool IsPower(std::uint32_t value, int exponent, int object_bits) {
  const std::uint64_t power = std::uint64_t{1} << exponent;
  if (exponent < object_bits) return value == power;
  return value == 0 || value == power - 1;
}

std::string DeviceTypeMismatch(const NodeFacts& facts) {
  const auto type = facts.Get(kDeviceType);
  if (!type) return "object 1000h cannot be read: no CANopen device by CiA 301; is the node id right?";
  if ((*type & 0xFFFF) == kEncoderProfile) return "";
  return Text("device type 0x%08X (1000h) is of profile %u, an encoder has 406: is node the encoder's id?", *type,
              *type & 0xFFFF);
}

std::string IdentityMismatch(const NodeFacts& facts, const Cia406Settings& settings) {
  for (std::size_t part = 0; part < kIdentityParts; ++part) {
    const auto& wanted = settings.identity.at(part);
    if (!wanted) continue;
    const auto found = facts.Get({kVendor.index, static_cast<std::uint8_t>(kVendor.sub + part)});
    if (found == wanted) continue;
    const std::string is = found ? Text("0x%X", *found) : "not offered";
    return Text("%s (1018h sub %zu) is %s, the file says 0x%X: another encoder, or change identity",
                kIdentityNames.at(part), part + 1, is.c_str(), *wanted);
  }
  return "";
}

std::string StepsMismatch(const char* object, std::uint32_t found, int bits) {
  return Text("%s is %u steps a turn, bits: %d means %u: set the encoder or bits right", object, found, bits,
              1U << bits);
}

// Without scaling the encoder's physical resolution counts.
std::string PhysicalMismatch(const NodeFacts& facts, const Cia406Settings& settings) {
  const auto steps = facts.Get(kPhysicalSteps);
  const auto turns = facts.Get(kPhysicalTurns);
  if (steps && !IsPower(*steps, settings.bits, 32)) {
    return StepsMismatch("scaling is off, and 6501h", *steps, settings.bits);
  }
  if (!turns || IsPower(*turns, settings.turn_bits, 16)) return "";
  if (settings.turn_bits == 0 && *turns == 0) return "";  // a single-turn encoder may say none
  return Text("scaling is off, and 6502h is %u turns, turn_bits: %d means %u: set the encoder or turn_bits right",
              *turns, settings.turn_bits, 1U << settings.turn_bits);
}

std::string ScaledMismatch(const NodeFacts& facts, const Cia406Settings& settings) {
  const auto steps = facts.Get(kUnitsPerTurn);
  const auto range = facts.Get(kTotalRange);
  if (steps && !IsPower(*steps, settings.bits, 32)) return StepsMismatch("6001h", *steps, settings.bits);
  if (!range || IsPower(*range, settings.total_bits(), 32)) return "";
  return Text("total range 6002h is %u, bits: %d with turn_bits: %d means 2^%d: set the encoder or these right",
              *range, settings.bits, settings.turn_bits, settings.total_bits());
}

std::string ResolutionMismatch(const NodeFacts& facts, const Cia406Settings& settings) {
  const auto status = facts.Get(kOperatingStatus);
  const bool physical = status && (*status & kScalingOn) == 0 && facts.Get(kPhysicalSteps);
  std::string problem = physical ? PhysicalMismatch(facts, settings) : ScaledMismatch(facts, settings);
  if (!problem.empty() || !status) return problem;
  const bool ccw = (*status & kCounterClockwise) != 0;
  if (ccw == settings.ccw_increases) return "";
  return Text("6500h says that it counts up %s, the file says counting: %s: set one of them right",
              ccw ? "ccw" : "cw", settings.ccw_increases ? "ccw" : "cw");
}

std::string TpdoMismatch(const NodeFacts& facts, const Cia406Settings& settings) {
  if (settings.mode == Mode::kPolled) return "";
  const auto id = facts.Get(kTpdoCobId);
  if (id && (*id & kPdoOff) != 0)
    return "TPDO1 is switched off (1800h sub 1, bit 31): switch it on, or use mode: sdo";
  if (id && (*id & kPdoIdMask) != settings.cob_id) {
    return Text("TPDO1 has COB-ID 0x%03X (1800h sub 1), the file expects 0x%03X: set cob_id", *id & kPdoIdMask,
                settings.cob_id);
  }
  const auto mapped = facts.Get(kTpdoFirst);
  if (mapped && *mapped != kMappedPosition) {
    return Text(
        "TPDO1 begins with 0x%08X (1A00h sub 1), not with the position 0x60040020: map it, or use mode: sdo",
        *mapped);
  }
  const auto type = facts.Get(kTpdoType);
  if (settings.mode == Mode::kSync && type && *type != 1) {
    return Text("TPDO1 has transmission type %u (1800h sub 2), transmission: sync needs 1: set one of them right",
                *type);
  }
  return "";
}

}  // namespace

void NodeFacts::Forget() { facts_ = {}; }

bool NodeFacts::Matters(ObjectId object) const {
  const bool of_tpdo = object.index == kTpdoCobId.index || object.index == kTpdoFirst.index;
  return mode_ != Mode::kPolled || !of_tpdo;
}

std::optional<ObjectId> NodeFacts::Wanted() const {
  static_assert(kObjects.size() == kFacts);
  for (std::size_t fact = 0; fact < kFacts; ++fact) {
    if (Matters(kObjects.at(fact)) && !facts_.at(fact).asked) return kObjects.at(fact);
  }
  return std::nullopt;
}

std::optional<std::uint32_t> NodeFacts::Get(ObjectId object) const {
  const auto* found = std::find(kObjects.begin(), kObjects.end(), object);
  if (found == kObjects.end()) return std::nullopt;
  return facts_.at(static_cast<std::size_t>(found - kObjects.begin())).value;
}

void NodeFacts::On(const SdoResult& result) {
  if (result.kind == SdoResult::Kind::kTimedOut || result.request.write) return;
  const auto* found = std::find(kObjects.begin(), kObjects.end(), result.request.object);
  if (found == kObjects.end()) return;
  Known& known = facts_.at(static_cast<std::size_t>(found - kObjects.begin()));
  known.asked = true;
  known.value.reset();
  if (result.kind == SdoResult::Kind::kValue) known.value = result.value;
}

bool NodeFacts::synchronous() const {
  const auto type = Get(kTpdoType);
  return mode_ == Mode::kSync || (type && *type >= 1 && *type <= kMaxCyclicSync);
}

std::string Mismatch(const NodeFacts& facts, const Cia406Settings& settings) {
  for (std::string problem : {DeviceTypeMismatch(facts), IdentityMismatch(facts, settings),
                              ResolutionMismatch(facts, settings), TpdoMismatch(facts, settings)}) {
    if (!problem.empty()) return problem;
  }
  return "";
}

}  // namespace axlecast::cia406
