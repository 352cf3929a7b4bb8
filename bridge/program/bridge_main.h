#pragma once

#include <functional>
#include <memory>

#include "bridge/store/durable_store.h"
#include "core/messages/message.h"

namespace axlecast {

// Wrappers around the journal and the command port, for tests. Empty: none.
struct BridgeInterposers {
  std::function<std::unique_ptr<DurableStore>(std::unique_ptr<DurableStore>)> store;  // in the journal's thread
  std::function<std::unique_ptr<MessageSink>(MessageSink&)> commands;
};

// The main function of axlecast-bridge: `--config FILE`. Returns the process's exit code: 0 after a clean stop, 1 for a
// mistake in the configuration, LCM or a second bridge, 2 for one on the command line.
[[nodiscard]] int BridgeMain(int argc, char** argv, const BridgeInterposers& interposers);

}  // namespace axlecast
