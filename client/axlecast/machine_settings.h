// Reads the settings of a client from the machine's file. The library links yaml-cpp, and the devices of every family, which the file
// describes. A control process that knows its URLs and keys fills ClientSettings itself and does not need it.
//
// C++17. Link axlecast_machine.
#pragma once

#include <axlecast/client_settings.h>

#include <string>

namespace axlecast {

// Returns the settings of the machine's file `file`, with the key `key_name` under `bridge: keys:`. With an empty name, the first key
// that can be read on this host is used, if any. Fails if the file or the named key cannot be used. Any thread.
[[nodiscard]] Result<ClientSettings> SettingsOfMachine(const std::string& file, const std::string& key_name);

}  // namespace axlecast
