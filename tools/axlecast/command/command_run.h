#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "client/axlecast/command.h"
#include "core/config/machine_config.h"

namespace axlecast {

// An operation as a person asked for it.
struct CommandOptions {
  std::string device;
  std::string operation;
  std::vector<std::string> words;  // key=value
  std::int32_t valid_ms = 5'000;
  std::int32_t epoch = -1;  // datum_epoch that it is meant for; -1 the present one
  std::string reason;
  bool asks = false;     // as a destructive operation does
  bool yes = false;      // do not ask
  bool json = false;     // the outcome as one JSON object, on standard output
  std::string key;       // file of the secret key that signs; empty: OperatorSettings finds one
  bool prepare = false;  // only say what would happen
  std::string commit;    // the token of a prepare, 32 hex digits: do it
  std::string out;       // file for the bytes that were read; empty: none
};

// Checks the wish, asks where it has to, has it done, tells the outcome. The command's exit code.
[[nodiscard]] int RunCommand(const MachineConfig& machine, const CommandOptions& wish);

// Asks the bridge how the command `id` stands, and tells it in the same way.
[[nodiscard]] int RunQuery(const MachineConfig& machine, const CommandId& id, bool json);

}  // namespace axlecast
