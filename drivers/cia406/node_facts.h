#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/base/result.h"
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

// Returns an error if a node with these facts is not the configured encoder: what differs, and what to change.
[[nodiscard]] Result<> CheckFacts(const NodeFacts& facts, const Cia406Settings& settings);

}  // namespace axlecast::cia406
