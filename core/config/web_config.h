#pragma once

#include <string>
#include <vector>

#include "core/base/secret.h"

namespace axlecast {

class ConfigMap;

// Where and to whom `axlecast web` serves its page.
struct WebConfig {
  std::string bind = "127.0.0.1";  // an address of this host, or a wildcard
  int port = 8380;
  std::string certificate = {};         // PEM file with its chain; empty: no TLS
  std::string key = {};                 // PEM file
  SecretPlace token = {};               // empty: everyone who can reach the address may view the page
  std::vector<std::string> names = {};  // under which browsers reach this host, besides its own
};

// Whether only this host reaches the address.
[[nodiscard]] bool IsLoopback(const std::string& address);

// What a browser opens. `host`: this host's name, for a wildcard.
[[nodiscard]] std::string WebUrl(const WebConfig& web, const std::string& host);

// What is wrong with it, and what would be right.
struct WebFault {
  const char* key;  // of docs/configuration.md
  std::string text;
};
[[nodiscard]] std::vector<WebFault> FaultsOf(const WebConfig& web);

// The `web` block.
[[nodiscard]] WebConfig LoadWeb(ConfigMap map);

}  // namespace axlecast
