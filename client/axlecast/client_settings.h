// Where commands and permits go, and who signs them. C++17; needs nothing else of axlecast.
#pragma once

#include <optional>
#include <string>

namespace axlecast {

struct ClientSettings {
  std::string command_url = "udpm://239.255.76.67:7668?ttl=0";  // as `lcm.command_url` of the machine's file
  std::string prefix = {};                                      // as `lcm.prefix`
  // The secret key that signs: a file (axlecast keygen), or a systemd credential. Neither: unsigned.
  std::string key_file = {};
  std::string key_credential = {};
  // The bridge's public key, 64 hex digits: only what it signed is believed. Empty: every status is believed.
  std::string bridge_key = {};

  // As the machine's file says. The key is the one under `bridge: keys:` that is called `key_name`; with an empty name
  // the first that can be read here, if any. Nothing when the file or the named key cannot be used: `error` says why.
  [[nodiscard]] static std::optional<ClientSettings> OfMachine(const std::string& file, const std::string& key_name,
                                                               std::string& error);
};

}  // namespace axlecast
