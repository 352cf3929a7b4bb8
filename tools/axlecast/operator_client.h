#pragma once

#include <string>

#include "drivers/io/lcm_port.h"
#include "drivers/io/system_clock.h"
#include "drivers/runtime/config/machine_config.h"
#include "tools/axlecast/cancel_on_signal.h"
#include "tools/axlecast/command_client.h"

namespace axlecast {

// A person's commands to a machine, one after another. Ctrl-C cancels the present one and those after it.
class OperatorClient {
 public:
  // With `tell` the progress of each goes to standard error.
  OperatorClient(const MachineConfig& machine, bool tell);

  // Empty when commands can be sent, else the cause and the lines that mend it.
  [[nodiscard]] const std::string& problem() const { return port_.problem(); }

  [[nodiscard]] CommandResult Execute(const CommandRequest& request);
  [[nodiscard]] CommandResult Query(const CommandId& id);

 private:
  LcmPort port_;
  SystemClock clock_;
  CommandClient client_;
  CancelOnSignal cancel_;
  CommandClient::Options options_;
};

}  // namespace axlecast
