#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "drivers/cia406/settings.h"
#include "drivers/protocol/canopen/sdo_client.h"

namespace axlecast::cia406 {

// What is read of a node before anything of it is believed (the list is in node_facts.cpp), as far as it was read.
// An object that the node does not offer is known to be absent.
class NodeFacts {
 public:
  explicit NodeFacts(Mode mode) : mode_(mode) {}

  void Forget();
  // The object to be read next; nothing when all is known.
  [[nodiscard]] std::optional<ObjectId> Wanted() const;
  // Any transfer of the node. One that timed out tells nothing.
  void On(const SdoResult& result);

  [[nodiscard]] bool complete() const { return !Wanted(); }
  // Nothing when the node does not offer the object, or was not asked yet.
  [[nodiscard]] std::optional<std::uint32_t> Get(ObjectId object) const;
  // TPDO1 is sent after each n-th SYNC.
  [[nodiscard]] bool synchronous() const;

 private:
  struct Known {
    bool asked = false;
    std::optional<std::uint32_t> value;
  };
  static constexpr std::size_t kFacts = 20;
  [[nodiscard]] bool Matters(ObjectId object) const;

  const Mode mode_;
  std::array<Known, kFacts> facts_{};
};

// Why a node with these facts is not the configured encoder, and what to do; empty when it is.
[[nodiscard]] std::string Mismatch(const NodeFacts& facts, const Cia406Settings& settings);

}  // namespace axlecast::cia406
