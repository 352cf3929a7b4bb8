#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bridge/store/alarm_store.h"
#include "bridge/store/axis_store.h"
#include "bridge/store/journal.h"

namespace axlecast {

// The bridge's memory that outlives it: commands, devices and alarms, in one place so that a crash leaves them agreeing.
class DurableStore : public Journal, public AxisStore, public AlarmStore {
 public:
  using AxisStore::Find;
  using Journal::Find;

  // Those that an earlier bridge left without outcome, or INDETERMINATE without finding; oldest first.
  [[nodiscard]] virtual std::vector<OpenCommand> Open() const = 0;
  // A number above every one that was ever reserved; the next `count` from it are the caller's. 0: it cannot.
  [[nodiscard]] virtual std::int64_t ReserveEpochs(std::int64_t at_least, std::int64_t count) = 0;
  // At least every 100 ms: writes what waits, tries again what failed.
  virtual void Tick(Timestamp now) = 0;
  // What was written before can be read: an id that is not found is not there.
  [[nodiscard]] virtual bool readable() const = 0;
  // Why nothing can be made durable at present, and what would help; empty when all is well.
  [[nodiscard]] virtual std::string problem() const = 0;
};

}  // namespace axlecast
