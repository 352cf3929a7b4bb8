#pragma once

#include <axlecast/command_status_t.hpp>
#include <optional>

#include "drivers/runtime/core/instant.h"
#include "drivers/runtime/core/operation.h"

namespace axlecast {

// What the bridge remembers of commands: for as long as an id is kept, its outcome is answered and never made
// again. The place for a durable journal; MemoryJournal lasts as long as the process.
class Journal {
 public:
  // An id is kept for so long after the end of its command's validity.
  static constexpr MonoNs kKeep = 24 * 3600 * kSecond;

  virtual ~Journal() = default;

  // Notes a command before anything is done for it; `status` also where it is refused. False when it cannot be
  // noted: then nothing may be done.
  [[nodiscard]] virtual bool Accepted(const command_status_t& status, MonoNs now, MonoNs keep_until) = 0;
  // Its state, progress or text changed.
  virtual void Step(const command_status_t& status) = 0;
  // Its one outcome; once more when a finding is added.
  virtual void Outcome(const command_status_t& status) = 0;

  [[nodiscard]] virtual std::optional<command_status_t> Find(const CommandId& id) const = 0;
};

}  // namespace axlecast
