#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>

#include "core/config/machine_config.h"
#include "tools/axlecast/common/config_option.h"

namespace axlecast {

// What `axlecast mqtt` was asked for.
struct MqttOptions {
  ConfigOption config;
  std::string broker;  // HOST[:PORT]
  std::string prefix;
  std::string client_id;
  std::string user;
  std::string password_file;
  std::string ca;
  std::string certificate;
  std::string key;
  std::string protocol;
  double interval_s = 0;  // 0: the file's
  double deadband = -1;   // < 0: the file's
  bool tls = false;
  bool print = false;
  bool schema = false;
  bool json = false;
  double seconds = 0;

  void AddTo(CLI::App& command);
};

// Puts what was given over what the machine's file says. Empty, or what is wrong and what would be right.
[[nodiscard]] std::string ApplyMqttOptions(const MqttOptions& options, MqttConfig& mqtt);

}  // namespace axlecast
