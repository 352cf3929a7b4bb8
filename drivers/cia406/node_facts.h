#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/base/result.h"
#include "drivers/cia406/settings.h"
#include "drivers/protocol/canopen/sdo_client.h"

namespace axlecast::cia406 {

// The objects that are read before a node is used (the list is in node_facts.cpp), as far as they were read.
class NodeFacts {
 public:
  explicit NodeFacts(Mode mode) : mode_(mode) {}

  void Forget() { facts_ = {}; }
  // Returns the object that must be read next; nothing if all were read.
  [[nodiscard]] std::optional<ObjectId> Missing() const;
  // Receives any transfer of the node. One that timed out is ignored.
  void On(const SdoResult& result);

  [[nodiscard]] bool complete() const { return !Missing(); }
  // Returns the value of an object of the list; nothing if the node does not offer it, or if it was not read yet.
  [[nodiscard]] std::optional<std::uint32_t> Get(ObjectId object) const;
  // Returns whether TPDO1 is sent after each n-th SYNC.
  [[nodiscard]] bool synchronous() const;

 private:
  struct Fact {
    bool read = false;
    std::optional<std::uint32_t> value;
  };
  static constexpr std::size_t kFacts = 20;
  [[nodiscard]] bool Matters(ObjectId object) const;

  const Mode mode_;
  std::array<Fact, kFacts> facts_{};
};

// Returns an error if a node with these facts is not the configured encoder: what differs, and what to change.
[[nodiscard]] Result<> CheckFacts(const NodeFacts& facts, const Cia406Settings& settings);

}  // namespace axlecast::cia406
