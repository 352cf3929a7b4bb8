#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/base/secret.h"
#include "core/config/service_config.h"

namespace axlecast {

// Returns the place of a secret whose file the command line names.
[[nodiscard]] SecretPlace SecretFileAt(const std::string& file);

// Where a web server listens and who may look, on the command line. They replace the values of the machine's file (`web:`).
struct WebServerOptions {
  std::optional<std::string> bind;
  std::optional<int> port;
  std::optional<std::string> certificate;
  std::optional<std::string> key;
  std::optional<std::string> token_file;
  std::vector<std::string> names;
  std::size_t clients = 16;

  // `port_text` and `clients_text` describe these options, `token_text` what the token is for.
  void AddTo(CLI::App& command, const std::string& port_text, const std::string& token_text,
             const std::string& clients_text);
  [[nodiscard]] WebConfig Over(WebConfig web) const;
};

// Returns the token, which is empty if none is required. Also checks that the TLS key can be read.
[[nodiscard]] Result<Secret> ReadWebSecrets(const WebConfig& web);

}  // namespace axlecast
