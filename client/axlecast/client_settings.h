// Where commands and permits go, and who signs them. C++17. machine_settings.h reads them from the machine's file.
#pragma once

#include <axlecast/result.h>

#include <string>

namespace axlecast {

struct ClientSettings {
  std::string command_url = "udpm://239.255.76.67:7668?ttl=0";  // as `lcm.command_url` of the machine's file
  std::string prefix = {};                                      // as `lcm.prefix`
  // The machine's name, as `machine` of its file: messages of other machines are ignored. Empty: those of all are taken.
  std::string machine = {};
  // The secret key that signs: a file (axlecast keygen), or a systemd credential. Neither: unsigned.
  std::string key_file = {};
  std::string key_credential = {};
  // The bridge's public key, 64 hex digits: only what it signed is believed. Empty: every status is believed.
  std::string bridge_key = {};
};

}  // namespace axlecast
