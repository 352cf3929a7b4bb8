#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/config/web_config.h"
#include "tools/axlecast/common/config_option.h"

namespace axlecast {

// What `axlecast web` was asked for.
struct WebOptions {
  ConfigOption config;
  std::vector<std::string> logs;
  std::optional<std::string> bind;
  std::optional<int> port;
  std::optional<std::string> certificate;
  std::optional<std::string> key;
  std::optional<std::string> token_file;
  std::vector<std::string> names;
  std::size_t clients = 16;

  void AddTo(CLI::App& command);
  // The file's block with what was said instead.
  [[nodiscard]] WebConfig Over(WebConfig web) const;
};

// A secret's file, as a command line names it.
[[nodiscard]] SecretPlace SecretFileAt(const std::string& file);

}  // namespace axlecast
