#pragma once

#include <optional>
#include <string>

#include "client/axlecast/command_client.h"
#include "core/config/machine_config.h"
#include "tools/axlecast/common/cancel_on_signal.h"

namespace axlecast {

// Where a person's commands to the machine go, and with which key: `key_file`, else $AXLECAST_KEY, else the first of the
// machine's keys, of `role` where one is given, that can be read here; else none.
[[nodiscard]] ClientSettings OperatorSettings(const MachineConfig& machine, const std::string& key_file,
                                              std::optional<Role> role = std::nullopt);

// A person's commands to a machine, one after another. Ctrl-C cancels the present one and those after it.
class OperatorClient {
 public:
  // `key_file`: see OperatorSettings. With `tell` the progress of each goes to standard error.
  OperatorClient(const MachineConfig& machine, const std::string& key_file, bool tell);

  // Empty when commands can be sent, else the cause and the lines that mend it.
  [[nodiscard]] std::string problem() const { return client_.problem(); }

  [[nodiscard]] CommandResult Execute(const CommandRequest& request);
  [[nodiscard]] CommandResult Query(const CommandId& id);

 private:
  CommandClient client_;
  CancelOnSignal cancel_;
};

}  // namespace axlecast
