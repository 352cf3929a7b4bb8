#pragma once

#include <axlecast/argument_t.hpp>
#include <axlecast/command_status_t.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "core/device/operation.h"

namespace axlecast {

// A command as it was accepted or refused.
struct CommandRecord {
  command_status_t status{};
  std::vector<argument_t> arguments = {};
  std::string reason = {};          // the client's, <= 160 bytes
  std::string who = {};             // name of the key that signed; "unsigned"
  std::int64_t key_id = 0;          // 0 unsigned
  std::int64_t bridge_boot_id = 0;  // of the bridge that took it up
  std::int64_t utime = 0;           // us, UNIX time of its acceptance
  std::int64_t begin_by_utime = 0;  // us, UNIX time until which it may begin
};

// A command that was accepted and has no outcome yet.
struct OpenCommand {
  CommandRecord record = {};    // its status as noted last; driver_boot_id 0: it was never sent
  std::int64_t sent_epoch = 0;  // no order for it has a higher bridge epoch
};

// What the bridge remembers of commands: for as long as an id is kept, its outcome is answered and never made again.
class Journal {
 public:
  virtual ~Journal() = default;

  // Notes a command before anything is done for it. False when it cannot be noted: then nothing may be done.
  [[nodiscard]] virtual bool Accepted(const CommandRecord& record, Timestamp now) = 0;
  // Before it is sent to a driver (status.driver_boot_id), with bridge epochs up to `epoch`. False: do not send it.
  [[nodiscard]] virtual bool Routed(const command_status_t& status, std::int64_t epoch, Timestamp now) = 0;
  // Its state, progress, text or changes became others. What was noted last may be missing after a crash.
  virtual void Step(const command_status_t& status, Timestamp now) = 0;
  // Its one outcome, before it is told; once more when a finding is added. What cannot be written is remembered as
  // long as the process lives, and written as soon as that works.
  virtual void Outcome(const command_status_t& status, Timestamp now) = 0;

  [[nodiscard]] virtual std::optional<command_status_t> Find(const CommandId& id) const = 0;
};

}  // namespace axlecast
