#pragma once

#include <cstddef>
#include <functional>

#include "bridge/store/durable_store.h"

namespace axlecast {

// Runs work on the durable store, so that a disk that does not answer holds up nobody else. The work runs in the order
// in which it was given, one at a time.
class JournalWorker {
 public:
  using Work = std::function<void(DurableStore& store)>;

  virtual ~JournalWorker() = default;

  // Returns at once. `work` may run in another thread; what it writes may be read when TakeFinished has counted it.
  virtual void Run(Work work) = 0;
  // How many pieces of work have ended since the last call.
  [[nodiscard]] virtual std::size_t TakeFinished() = 0;
};

}  // namespace axlecast
