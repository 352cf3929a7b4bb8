#include "core/config/service_config.h"

#include <arpa/inet.h>

#include <algorithm>
#include <string_view>

#include "core/base/expression.h"
#include "core/base/spelling.h"
#include "core/base/text.h"
#include "core/config/config_map.h"

namespace axlecast {
namespace {

void AddErrors(const std::vector<ConfigFault>& faults, ConfigMap& map) {
  for (const ConfigFault& fault : faults) map.Error(fault.key, fault.text);
}

std::string LoadPem(ConfigMap& map, const std::string& key) {
  return map.File(key, "/etc/axlecast/" + key + ".pem");
}

constexpr std::int64_t kMinSplit = 1 << 20;  // bytes: every log carries some 60 kB of header
constexpr std::int64_t kMinBuffer = 16 << 10;
constexpr int kLogsKept = 8;  // unless split_size or split_time is given

constexpr std::size_t kMaxLogs = 16;
constexpr MonoNs kDay = 86'400 * kSecond;

LogConfig LoadLog(const std::string& name, ConfigMap& map) {
  LogConfig log;
  log.name = name;
  map.CheckName(name);
  log.channels = map.String("channels", "");
  log.invert = map.Bool("invert", false);
  log.split_bytes = map.Size("split_size", log.split_bytes);
  log.split_time = map.Time("split_time", log.split_time);
  log.quota_bytes = map.Size("quota", log.quota_bytes);
  log.keep = map.Time("keep", log.keep);
  log.compress = map.Bool("compress", log.compress);
  log.sync =
      map.Integer("fsync_ms", log.sync / kMillisecond, 0, 3'600'000, "ms (0: after every write)") * kMillisecond;
  log.buffer_bytes = map.Size("buffer", log.buffer_bytes);
  log.trigger = map.String("trigger", "");
  log.pre_trigger = map.Time("pre_trigger", log.pre_trigger);
  log.post_trigger = map.Time("post_trigger", log.post_trigger);
  AddErrors(FaultsOf(log), map);
  map.Done();
  return log;
}

constexpr std::size_t kLongestPrefix = 64;
constexpr std::size_t kLongestHost = 253;     // of a name in DNS
constexpr std::size_t kLongestClientId = 64;  // MQTT 3.1.1 asks brokers for 23 only; the usual ones take more
constexpr double kMaxDeadband = 1e12;

bool IsPlain(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c > ' ' && c < '\x7F'; });
}

// Levels that hold something, without what MQTT reserves.
bool IsTopic(std::string_view text) {
  return !text.empty() && text.size() <= kLongestPrefix && IsPlain(text) && text.front() != '/' &&
         text.back() != '/' && text.front() != '$' && text.find("//") == std::string_view::npos &&
         text.find_first_of("+#") == std::string_view::npos;
}

// A level of a Sparkplug topic.
bool IsSparkplugId(std::string_view text) {
  return !text.empty() && text.size() <= kLongestPrefix && !FindUnsafe(text, 0, TextShape::kOneLine) &&
         text.find_first_of("+#/") == std::string_view::npos;
}

// Reads a pace; `pace` contains the defaults.
PositionPace LoadPace(ConfigMap& map, PositionPace pace) {
  pace.interval = map.Time("interval", pace.interval);
  pace.deadband = map.Number("deadband", pace.deadband, 0, kMaxDeadband, "(in the device's unit)");
  pace.longest = map.Time("longest", pace.longest);
  if (!map.Has("longest")) pace.longest = std::max(pace.longest, pace.interval);
  AddErrors(FaultsOf(pace), map);
  return pace;
}

void LoadPositions(ConfigMap map, const std::vector<std::string>& devices, MqttConfig& mqtt) {
  mqtt.positions = LoadPace(map, mqtt.positions);
  for (auto& [name, keys] : map.Maps("devices")) {
    if (std::find(devices.begin(), devices.end(), name) == devices.end()) {
      map.Error("devices", "there is no device " + Quoted(name) +
                               Suggestion(name, devices, "; known here: " + Listed(devices)));
    }
    mqtt.devices[name] = LoadPace(keys, mqtt.positions);
    keys.Done();
  }
  map.Done();
}

void LoadTls(ConfigMap map, MqttConfig& mqtt) {
  MqttTls& tls = mqtt.tls.emplace();
  tls.ca = LoadPem(map, "ca");
  tls.certificate = LoadPem(map, "certificate");
  tls.key = LoadPem(map, "key");
  map.Done();
}

void LoadQueue(ConfigMap map, MqttConfig& mqtt) {
  mqtt.queue_messages = map.Integer("messages", mqtt.queue_messages, kMinQueueMessages, 10'000'000, "messages");
  mqtt.queue_bytes = map.Size("size", mqtt.queue_bytes);
  map.Done();
}

void LoadSparkplug(ConfigMap map, MqttConfig& mqtt) {
  SparkplugConfig& sparkplug = mqtt.sparkplug.emplace();
  map.MarkRequired("group");
  sparkplug.group = map.String("group", "");
  sparkplug.node = map.String("node", "");
  sparkplug.primary_host = map.String("primary_host", "");
  ConfigMap outbox = map.Map("outbox");
  sparkplug.directory = outbox.File("directory", "/var/lib/axlecast-mqtt");
  sparkplug.outbox_bytes = outbox.Size("size", sparkplug.outbox_bytes);
  sparkplug.sync =
      outbox.Integer("fsync_ms", sparkplug.sync / kMillisecond, 0, 3'600'000, "ms (0: after every write)") *
      kMillisecond;
  sparkplug.repeat = outbox.Time("repeat", sparkplug.repeat);
  outbox.Done();
  map.Done();
}

}  // namespace

std::vector<ConfigFault> FaultsOf(const LogConfig& log) {
  std::vector<ConfigFault> faults;
  const auto require = [&faults](bool holds, const char* key, const char* text) {
    if (!holds) faults.push_back({key, text});
  };
  const auto require_expression = [&faults](const std::string& text, const char* key) {
    if (text.empty()) return;
    if (const auto expression = CompileExpression(text); !expression)
      faults.push_back({key, expression.error().text});
  };
  require_expression(log.channels, "channels");
  require_expression(log.trigger, "trigger");
  require(!log.invert || !log.channels.empty(), "invert", "needs channels: the expression that is inverted");
  require(log.split_bytes == 0 || log.split_bytes >= kMinSplit, "split_size", "is at least 1MB");
  require(log.quota_bytes == 0 || log.quota_bytes >= 2 * kMinSplit, "quota", "is at least 2MB");
  require(log.quota_bytes == 0 || log.split_bytes <= log.quota_bytes / 2, "split_size",
          "is at most half of the quota: the log being written is never deleted");
  require(log.split_time == 0 || log.split_time >= kSecond, "split_time", "is at least 1s");
  require(log.keep == 0 || log.keep >= 60 * kSecond, "keep", "is at least 1m");
  require(log.keep == 0 || log.split_time <= log.keep, "split_time",
          "is at most as long as keep: the log being written is never deleted");
  require(log.buffer_bytes >= kMinBuffer, "buffer", "is at least 16kB");
  require(log.trigger.empty() || log.pre_trigger > 0, "trigger", "needs a pre_trigger beside it: 30s");
  require(!log.trigger.empty() || log.pre_trigger == 0, "pre_trigger", "needs a trigger beside it");
  require(log.pre_trigger <= 3'600 * kSecond, "pre_trigger", "is at most 1h: it is kept in memory");
  require(log.post_trigger <= kDay, "post_trigger", "is at most 1d");
  return faults;
}

std::int64_t SplitBytes(const LogConfig& log) {
  if (log.split_bytes > 0 || log.quota_bytes == 0) return log.split_bytes;
  return std::max(kMinSplit, log.quota_bytes / kLogsKept);
}

MonoNs SplitTime(const LogConfig& log) {
  if (log.split_time > 0 || log.keep == 0) return log.split_time;
  return std::clamp(log.keep / kLogsKept, kSecond, kDay);
}

RecorderConfig LoadRecorder(ConfigMap map) {
  RecorderConfig recorder;
  recorder.directory = map.File("directory", "/var/log/axlecast");
  map.MarkRequired("logs");
  auto logs = map.Maps("logs");
  if (map.given() && logs.empty()) {
    map.Error("logs", "is missing or empty: name at least one log, e.g. {all: {quota: 20GB}}");
  }
  if (logs.size() > kMaxLogs) {
    map.Error("logs", std::to_string(logs.size()) + " logs: at most " + std::to_string(kMaxLogs) +
                          ", because each receives all messages by itself");
  } else {
    for (auto& [name, log] : logs) recorder.logs.push_back(LoadLog(name, log));
  }
  map.Done();
  return recorder;
}

bool IsIpAddress(const std::string& text) {
  if (text.find('\0') != std::string::npos) return false;  // inet_pton would read only what is before it
  in_addr v4{};
  in6_addr v6{};
  return inet_pton(AF_INET, text.c_str(), &v4) == 1 || inet_pton(AF_INET6, text.c_str(), &v6) == 1;
}

bool IsLoopback(const std::string& address) {
  in_addr v4{};
  in6_addr v6{};
  if (inet_pton(AF_INET, address.c_str(), &v4) == 1) return ntohl(v4.s_addr) >> 24U == 127;
  return inet_pton(AF_INET6, address.c_str(), &v6) == 1 && IN6_IS_ADDR_LOOPBACK(&v6);
}

std::string WebUrl(const WebConfig& web, const std::string& host) {
  const bool any = web.bind == "0.0.0.0" || web.bind == "::";
  const bool v6 = web.bind.find(':') != std::string::npos;
  const std::string name = any ? host : v6 ? '[' + web.bind + ']' : web.bind;
  return (web.certificate.empty() ? "http://" : "https://") + name + ':' + std::to_string(web.port) + '/';
}

std::vector<ConfigFault> FaultsOf(const WebConfig& web) {
  std::vector<ConfigFault> faults;
  const bool numeric = IsIpAddress(web.bind);
  if (!numeric) faults.push_back({"bind", Quoted(web.bind) + " is no address, e.g. 127.0.0.1, ::1 or 0.0.0.0"});
  if (web.certificate.empty() != web.key.empty()) {
    faults.push_back({web.key.empty() ? "tls_cert" : "tls_key",
                      std::string("needs ") + (web.key.empty() ? "tls_key" : "tls_cert") + " beside it"});
  }
  if (!numeric || IsLoopback(web.bind)) return faults;
  const std::string why = Quoted(web.bind) + " is reached from other hosts: ";
  if (web.certificate.empty()) faults.push_back({"bind", why + "needs tls_cert and tls_key"});
  if (web.token.empty()) faults.push_back({"bind", why + "needs a token"});
  return faults;
}

namespace {

void LoadFleet(ConfigMap map, WebConfig& web) {
  web.fleet_database = map.RequiredString("database");
  web.fleet_password = LoadSecret(map, "password", "/etc/axlecast/fleet.password");
  web.fleet_password.group_may_read = true;
  map.Done();
}

}  // namespace

WebConfig LoadWeb(ConfigMap map) {
  WebConfig web;
  web.bind = map.String("bind", web.bind);
  web.port = static_cast<int>(map.Integer("port", web.port, 1, 65535, "(TCP)"));
  web.certificate = LoadPem(map, "tls_cert");
  web.key = LoadPem(map, "tls_key");
  if (map.Has("token")) {
    ConfigMap token = map.Map("token");
    web.token = LoadPlace(token, "/etc/axlecast/web.token");
    web.token.group_may_read = true;
    token.Done();
  }
  web.names = map.Strings("names");
  if (map.Has("fleet")) LoadFleet(map.Map("fleet"), web);
  AddErrors(FaultsOf(web), map);
  map.Done();
  return web;
}

std::vector<ConfigFault> FaultsOf(const MqttConfig& mqtt) {
  std::vector<ConfigFault> faults;
  const auto require = [&faults](bool holds, const char* key, const char* text) {
    if (!holds) faults.push_back({key, text});
  };
  require(!mqtt.host.empty() && mqtt.host.size() <= kLongestHost && IsPlain(mqtt.host), "host",
          "is the broker's name or address: broker.example, 192.0.2.7");
  require(
      IsTopic(mqtt.prefix), "prefix",
      "is the beginning of topics: 1 to 64 characters without +, #, blanks and a leading $, / between levels only");
  require(mqtt.client_id.size() <= kLongestClientId && IsPlain(mqtt.client_id), "client_id",
          "has at most 64 characters without blanks");
  require(mqtt.password.empty() || !mqtt.user.empty(), "password", "needs user beside it");
  if (mqtt.tls) {
    require(mqtt.tls->certificate.empty() == mqtt.tls->key.empty(), "tls",
            "certificate and key belong together: give both or none");
  }
  require(mqtt.queue_messages >= kMinQueueMessages, "queue", "messages is at least 100");
  require(mqtt.queue_bytes >= kMinQueueBytes, "queue", "size is at least 256kB");
  if (!mqtt.sparkplug) return faults;
  const SparkplugConfig& sparkplug = *mqtt.sparkplug;
  const std::string rule = " is 1 to 64 characters without +, # and /";
  require(IsSparkplugId(sparkplug.group), "sparkplug", ("group" + rule + ", e.g. plant").c_str());
  require(sparkplug.node.empty() || IsSparkplugId(sparkplug.node), "sparkplug", ("node" + rule).c_str());
  require(sparkplug.primary_host.empty() || IsSparkplugId(sparkplug.primary_host), "sparkplug",
          ("primary_host" + rule).c_str());
  require(sparkplug.outbox_bytes >= kMinOutboxBytes, "sparkplug", "outbox: size is at least 1MB");
  require(sparkplug.repeat <= 3'600 * kSecond, "sparkplug", "outbox: repeat is at most 1h");
  return faults;
}

std::vector<ConfigFault> FaultsOf(const PositionPace& pace) {
  std::vector<ConfigFault> faults;
  if (pace.interval < 10 * kMillisecond || pace.interval > kDay) {
    faults.push_back({"interval", "is 0.01s to 1d: more is for LCM"});
  }
  if (pace.longest < pace.interval || pace.longest > kDay) {
    faults.push_back({"longest", "is from interval to 1d"});
  }
  return faults;
}

std::int64_t PortOf(const MqttConfig& mqtt) {
  if (mqtt.port != 0) return mqtt.port;
  return mqtt.tls ? 8883 : 1883;
}

const PositionPace& PaceOf(const MqttConfig& mqtt, const std::string& device) {
  const auto found = mqtt.devices.find(device);
  return found == mqtt.devices.end() ? mqtt.positions : found->second;
}

std::string BrokerText(const MqttConfig& mqtt) {
  const bool address = mqtt.host.find(':') != std::string::npos;
  return (address ? '[' + mqtt.host + ']' : mqtt.host) + ':' + std::to_string(PortOf(mqtt));
}

MqttConfig LoadMqtt(ConfigMap map, const std::vector<std::string>& devices) {
  MqttConfig mqtt;
  map.MarkRequired("host");
  mqtt.host = map.String("host", "");
  mqtt.port = map.Integer("port", 0, 1, 65'535, "(1883, with tls 8883)");
  mqtt.version_5 = map.Choice("protocol", {"5", "3.1.1"}, 0) == 0;
  mqtt.prefix = map.String("prefix", mqtt.prefix);
  mqtt.client_id = map.String("client_id", "");
  mqtt.user = map.String("user", "");
  mqtt.password = LoadSecret(map, "password", "/etc/axlecast/mqtt.password");
  if (map.Has("tls")) LoadTls(map.Map("tls"), mqtt);
  LoadPositions(map.Map("positions"), devices, mqtt);
  LoadQueue(map.Map("queue"), mqtt);
  if (map.Has("sparkplug")) LoadSparkplug(map.Map("sparkplug"), mqtt);
  if (map.given()) AddErrors(FaultsOf(mqtt), map);
  map.Done();
  return mqtt;
}

bool IsHostName(std::string_view text) {
  constexpr std::size_t kLongest = 40;  // TIME/<host> with a prefix is a channel's name of LCM
  return !text.empty() && text.size() <= kLongest &&
         std::all_of(text.begin(), text.end(), [](unsigned char character) {
           return std::isalnum(character) != 0 || character == '-' || character == '_' || character == '.';
         });
}

std::vector<ConfigFault> FaultsOf(const TimeConfig& time) {
  std::vector<ConfigFault> faults;
  if (!IsHostName(time.root)) {
    faults.push_back(
        {"root", Quoted(time.root) + " is no name of a host: letters, digits, '-', '_' and '.', at most 40"});
  }
  if (!IsIpAddress(time.address)) {
    faults.push_back(
        {"address", Quoted(time.address) + " is no IP address of the root, e.g. 192.0.2.7 or fd00::7"});
  }
  return faults;
}

TimeConfig LoadTime(ConfigMap map) {
  TimeConfig time;
  time.root = map.String("root", "");
  time.address = map.String("address", "");
  time.port = static_cast<int>(map.Integer("port", time.port, 1, 65'535, "(UDP)"));
  time.max_rate_ppm = static_cast<int>(map.Integer("max_rate_ppm", time.max_rate_ppm, 1, 1'000, "ppm"));
  time.max_slew_ppm = static_cast<int>(map.Integer("max_slew_ppm", time.max_slew_ppm, 1, 100'000, "ppm"));
  time.ptp_bound_us =
      static_cast<int>(map.Integer("ptp_bound_us", 0, 0, 1'000'000, "us (0: nothing is assumed of PTP)"));
  if (map.given()) AddErrors(FaultsOf(time), map);
  map.Done();
  return time;
}

}  // namespace axlecast
