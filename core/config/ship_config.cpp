#include "core/config/ship_config.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <regex>
#include <string_view>

#include "core/base/expression.h"
#include "core/base/spelling.h"
#include "core/config/config_map.h"
#include "core/config/listen_address.h"

namespace axlecast {
namespace {

constexpr double kMaxDeadband = 1e12;
constexpr MonoNs kDay = 86'400 * kSecond;
constexpr std::int64_t kMinBandwidth = 10'000;  // bytes a second: below, a seal of a busy machine takes minutes
constexpr double kMaxReserve = 90;              // percent

// Reads "5%". Returns nothing for another text.
std::optional<double> ParsePercent(std::string_view text) {
  if (!text.ends_with('%')) return std::nullopt;
  text.remove_suffix(1);
  double percent = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), percent);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return percent;
}

void LoadReserve(ConfigMap& map, ShipConfig& ship) {
  const std::string text = map.String("reserve", "5%");
  if (const std::optional<double> percent = ParsePercent(text)) {
    ship.reserve_percent = *percent;
  } else if (const std::optional<std::int64_t> bytes = ParseSize(text); bytes && *bytes > 0) {
    ship.reserve_bytes = *bytes;
    ship.reserve_percent = 0;
  } else {
    map.Error("reserve", Quoted(text) + " is neither a part of the disk nor a size: 5%, 20GB");
  }
}

ShipRule LoadRule(ConfigMap& map) {
  ShipRule rule;
  rule.channels = map.RequiredString("channels");
  rule.detail = static_cast<ShipLevel>(map.Choice("detail", {"none", "rollup", "deadband", "samples", "full"},
                                                  static_cast<std::size_t>(rule.detail)));
  rule.deadband = map.Number("deadband", rule.deadband, 0, kMaxDeadband, "(in the device's unit)");
  rule.longest = map.Time("longest", rule.longest);
  rule.raw = map.Bool("raw", rule.raw);
  for (const ConfigFault& fault : FaultsOf(rule)) map.Error(fault.key, fault.text);
  map.Done();
  return rule;
}

}  // namespace

bool HasPassword(const std::string& connection) {
  static const std::regex kPassword(R"((^|[\s?&'])(ssl)?password\s*=|://[^/@:]*:[^/@]*@)", std::regex::icase);
  return std::regex_search(connection, kPassword);
}

std::vector<ConfigFault> FaultsOf(const ShipRule& rule) {
  std::vector<ConfigFault> faults;
  const auto require = [&faults](bool holds, const char* key, const char* text) {
    if (!holds) faults.push_back({key, text});
  };
  if (rule.channels.empty()) {
    faults.push_back({"channels", "is empty: a regular expression that selects channels, e.g. '^POSITION/'"});
  } else if (const auto expression = CompileExpression(rule.channels); !expression) {
    faults.push_back({"channels", expression.error().text});
  }
  const bool deadband = rule.detail == ShipLevel::kDeadband;
  require(!deadband || rule.deadband > 0, "detail",
          "deadband needs deadband beside it: the least movement to store");
  require(deadband || rule.deadband == 0, "deadband", "needs `detail: deadband` beside it");
  require(rule.longest >= kSecond && rule.longest <= kDay, "longest", "is 1s to 1d");
  return faults;
}

std::vector<ConfigFault> FaultsOf(const ShipConfig& ship) {
  std::vector<ConfigFault> faults;
  const auto require = [&faults](bool holds, const char* key, const char* text) {
    if (!holds) faults.push_back({key, text});
  };
  require(!ship.database.empty(), "database",
          "is missing or empty: a connection string, e.g. \"host=db1 dbname=axlecast user=axlecast_press\"");
  require(!HasPassword(ship.database), "database",
          "contains a password: remove it, and give `password: {file: /etc/axlecast/ship.password}`");
  require(ship.bandwidth == 0 || ship.bandwidth >= kMinBandwidth, "bandwidth", "is at least 10kB (a second)");
  require(ship.reserve_bytes > 0 || (ship.reserve_percent > 0 && ship.reserve_percent <= kMaxReserve), "reserve",
          "is more than 0% and at most 90%, or a size");
  if (!ship.metrics.empty()) {
    if (const auto listen = ParseListenAddress(ship.metrics); !listen)
      faults.push_back({"metrics", listen.error().text});
  }
  return faults;
}

ShipConfig LoadShip(ConfigMap map) {
  ShipConfig ship;
  map.MarkRequired("database");
  ship.database = map.String("database", "");
  ship.password = LoadSecret(map, "password", "/etc/axlecast/ship.password");
  ship.newest_first = map.Choice("order", {"newest_first", "oldest_first"}, 0) == 0;
  ship.bandwidth = map.Size("bandwidth", ship.bandwidth);
  LoadReserve(map, ship);
  ship.metrics = map.String("metrics", "");
  for (ConfigMap& rule : map.List("detail")) ship.rules.push_back(LoadRule(rule));
  if (map.given()) {
    for (const ConfigFault& fault : FaultsOf(ship)) map.Error(fault.key, fault.text);
  }
  map.Done();
  return ship;
}

}  // namespace axlecast
