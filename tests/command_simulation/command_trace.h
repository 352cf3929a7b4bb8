#pragma once

#include <axlecast/command_status_t.hpp>
#include <axlecast/driver_status_t.hpp>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "bridge/store/memory_store_fixture.h"
#include "core/device/operation.h"
#include "core/messages/message.h"

namespace axlecast {

// The observable events of a world of one device, in their sequence, one line each: what the journal stores, what bridge and
// driver send, the effects on the device, and the kills. tests/model checks that they are a run of its model.
//
//   EVENT COMMAND [WORD]                        COMMAND: number of the command, from 0
//   order KIND COMMAND BRIDGE EPOCH DRIVER      DRIVER_COMMAND; COMMAND is - for an order of the bridge itself
//
// A boot of the driver is written as 1, 2, ...
class CommandTrace {
 public:
  void Add(std::string_view event, const CommandId& id, std::string_view word = {});
  void BridgeKilled() { lines_.emplace_back("bridge_killed"); }
  // Each start of the driver after the first one follows a kill.
  void DriverStarted(std::int64_t boot_id);
  // Anything that is published, lost or not.
  void OnMessage(const std::string& channel, Bytes message);
  void Routed(const command_status_t& status);
  // An outcome in the journal, and a finding.
  void Outcome(const command_status_t& status);

  [[nodiscard]] const std::vector<std::string>& lines() const { return lines_; }

 private:
  void OnOrder(Bytes message);
  void OnDriverStatus(Bytes message);
  void OnStatus(Bytes message);
  [[nodiscard]] bool IsFirst(std::string_view event, const CommandId& id, std::int64_t value);
  [[nodiscard]] std::string Driver(std::int64_t boot_id) const;

  std::vector<std::string> lines_;
  std::map<std::int64_t, std::size_t> drivers_;  // 1, 2, ... by boot id
  std::set<std::tuple<std::string, CommandId, std::int64_t>> written_;
};

// A journal whose entries are traced, if `trace` is set.
class TracedStore final : public MemoryStore {
 public:
  CommandTrace* trace = nullptr;

  bool Accepted(const CommandRecord& record, Timestamp now) override;
  bool Routed(const command_status_t& status, std::int64_t epoch, Timestamp now) override;
  void Outcome(const command_status_t& status, Timestamp now) override;
};

}  // namespace axlecast
