#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/base/secret.h"
#include "core/base/time.h"
#include "core/config/service_config.h"

namespace axlecast {

// How much of a channel goes to the fleet database, from nothing to everything.
enum class ShipLevel : std::uint8_t { kNone, kRollup, kDeadband, kSamples, kFull };

// The detail of the channels that match. The first rule that matches a channel decides.
struct ShipRule {
  std::string channels;  // regular expression, over names without the machine's prefix
  ShipLevel detail = ShipLevel::kSamples;
  double deadband = 0;            // kDeadband: in the device's unit
  MonoNs longest = 10 * kSecond;  // kDeadband: maximum time between two stored samples
  bool raw = false;               // the records are stored unchanged as well
};

// Where `axlecast ship` writes the machine's logs: docs/fleet.md.
struct ShipConfig {
  std::string database;  // libpq's connection string, without a password; empty: nowhere
  SecretPlace password;
  bool newest_first = true;    // order of the logs that wait
  std::int64_t bandwidth = 0;  // bytes of logs per second, except current data; 0: no limit
  double reserve_percent = 5;  // of the disk; used if reserve_bytes is 0
  std::int64_t reserve_bytes = 0;
  std::string metrics;  // [ADDRESS:]PORT that serves the shipper's metrics: ParseListenAddress; empty: none
  std::vector<ShipRule> rules;
};

// Returns true if the connection string contains a password, which every user could read in the file and in a list of processes.
[[nodiscard]] bool HasPassword(const std::string& connection);

[[nodiscard]] std::vector<ConfigFault> FaultsOf(const ShipConfig& ship);
[[nodiscard]] std::vector<ConfigFault> FaultsOf(const ShipRule& rule);

// Reads `ship`.
[[nodiscard]] ShipConfig LoadShip(ConfigMap map);

}  // namespace axlecast
