#pragma once

#include <string>
#include <vector>

#include "core/base/result.h"
#include "platform/os/folder.h"

namespace axlecast {

// The place that ships a machine's logs, as its state folder defines it: <folder>/installation.json. The database accepts a machine
// from one installation only, so that two machines with one name do not mix their data.
struct Installation {
  std::string id;  // UUID
  std::vector<std::string>
      names;  // of the machine, as it was and is called here: logs with these names are its own
  bool operator==(const Installation&) const = default;
};

// {"installation":"0f0e…","names":["press3"]}
[[nodiscard]] std::string FormatInstallation(const Installation& installation);
[[nodiscard]] Result<Installation> ParseInstallation(std::string_view text);

// Returns a random UUID (RFC 4122, version 4).
[[nodiscard]] std::string NewInstallationId();

// Returns the state folder without --state: $STATE_DIRECTORY (systemd.exec(5)), else $XDG_STATE_HOME/axlecast/ship, else
// $HOME/.local/state/axlecast/ship. It is the same for every machine name, so that a renamed machine is recognised.
[[nodiscard]] std::string DefaultShipState();

// The state folder of a running shipper. A second shipper of this host with the same folder is refused.
class ShipState {
 public:
  // Creates the folder and the installation if they are missing, and locks the folder.
  [[nodiscard]] Result<> Open(const std::string& folder);
  [[nodiscard]] const Installation& installation() const { return installation_; }
  // Adds a name of the machine, durably.
  [[nodiscard]] Result<> AddName(const std::string& name);

 private:
  [[nodiscard]] Result<> Save(const Installation& installation) const;

  std::string file_;
  LockFile lock_;
  Installation installation_;
};

}  // namespace axlecast
