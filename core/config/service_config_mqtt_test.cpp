#include "core/config/service_config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/config/load.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;

// The keys of mqtt begin in line 3.
std::optional<MachineConfig> Parse(const std::string& mqtt, ConfigErrors& errors) {
  return ParseConfig(
      "machine: press3\nmqtt:" + mqtt + "\nbuses:\n  b0: {family: point, simulate: true, devices: {axis1: {}}}\n",
      errors);
}

MqttConfig Mqtt(const std::string& keys) {
  ConfigErrors errors("m.yaml");
  const auto machine = Parse(keys, errors);
  EXPECT_EQ(errors.Text(), "");
  return machine ? machine->mqtt : MqttConfig{};
}

TEST(LoadMqtt, ReadsEveryKey) {
  const MqttConfig mqtt = Mqtt(
      "\n  host: broker.example\n"
      "  port: 8884\n"
      "  protocol: 3.1.1\n"
      "  prefix: plant/hall2\n"
      "  client_id: press\n"
      "  user: press3\n"
      "  password: {file: /etc/axlecast/mqtt.password}\n"
      "  tls: {ca: /etc/ca.pem, certificate: /etc/c.pem, key: /etc/k.pem}\n"
      "  positions: {interval: 2s, deadband: 0.25, longest: 1m, devices: {axis1: {interval: 0.1s}}}\n"
      "  queue: {messages: 500, size: 1MB}");
  EXPECT_EQ(BrokerText(mqtt), "broker.example:8884");
  EXPECT_FALSE(mqtt.version_5);
  EXPECT_EQ(mqtt.prefix, "plant/hall2");
  EXPECT_EQ(mqtt.client_id, "press");
  EXPECT_EQ(mqtt.user, "press3");
  EXPECT_EQ(mqtt.password.file, "/etc/axlecast/mqtt.password");
  ASSERT_TRUE(mqtt.tls);
  EXPECT_EQ(mqtt.tls->ca, "/etc/ca.pem");
  EXPECT_EQ(mqtt.tls->certificate, "/etc/c.pem");
  EXPECT_EQ(mqtt.tls->key, "/etc/k.pem");
  EXPECT_EQ(mqtt.positions.interval, 2 * kSecond);
  EXPECT_EQ(PaceOf(mqtt, "axis1").interval, kSecond / 10);
  EXPECT_EQ(PaceOf(mqtt, "axis1").deadband, 0.25) << "as for all devices, but for its own keys";
  EXPECT_EQ(PaceOf(mqtt, "axis2").longest, 60 * kSecond);
  EXPECT_EQ(mqtt.queue_messages, 500);
  EXPECT_EQ(mqtt.queue_bytes, 1 << 20);
}

TEST(LoadMqtt, AHostIsEnough) {
  const MqttConfig mqtt = Mqtt(" {host: '2001:db8::1'}");
  EXPECT_EQ(BrokerText(mqtt), "[2001:db8::1]:1883");
  EXPECT_TRUE(mqtt.version_5);
  EXPECT_EQ(mqtt.positions.interval, kSecond);
  EXPECT_EQ(BrokerText(Mqtt(" {host: b, tls: {}}")), "b:8883");
}

TEST(LoadMqtt, WithoutTheSectionThereIsNoBroker) {
  ConfigErrors errors("m.yaml");
  const auto machine =
      ParseConfig("machine: a\nbuses:\n  b0: {family: point, simulate: true, devices: {axis1: {}}}\n", errors);
  ASSERT_TRUE(machine);
  EXPECT_EQ(machine->mqtt.host, "");
}

TEST(LoadMqtt, NamesPlaceValueAndWhatIsRight) {
  const struct {
    const char* mqtt;
    const char* message;
  } mistakes[] = {
      {"", "m.yaml:2:1: mqtt.host: is the broker's name or address"},
      {" x", "mqtt: 'x' is given where a mapping"},
      {" {hots: b}", "mqtt: unknown key 'hots'; did you mean 'host'?"},
      {" {host: b, port: 0}", "mqtt.port: '0' is not within 1 to 65535"},
      {" {host: b, protocol: 4}", "mqtt.protocol: '4' is not one of 5, 3.1.1"},
      {" {host: b, prefix: 'a/#'}", "2:25: mqtt.prefix: is the beginning of topics"},
      {" {host: b, prefix: /a}", "mqtt.prefix: is the beginning of topics"},
      {" {host: b, prefix: $SYS}", "mqtt.prefix: is the beginning of topics"},
      {" {host: b, client_id: 'a b'}", "mqtt.client_id: has at most 64 characters"},
      {" {host: b, password: {file: /a}}", "mqtt.password: needs user beside it"},
      {" {host: b, user: u, password: geheim}", "2:36: mqtt.password: names no place"},
      {" {host: b, user: u, password: {}}", "mqtt.password: names no place"},
      {" {host: b, user: u, password: {file: a}}", "mqtt.password.file: 'a' is no absolute path"},
      {" {host: b, tls: {ca: ca.pem}}", "mqtt.tls.ca: 'ca.pem' is no absolute path"},
      {" {host: b, tls: {key: /k}}", "mqtt.tls: certificate and key belong together"},
      {" {host: b, positions: {interval: 1}}", "mqtt.positions.interval: '1' is not a time"},
      {" {host: b, positions: {interval: 0.001s}}", "mqtt.positions.interval: is 0.01s to 1d"},
      {" {host: b, positions: {deadband: -1}}", "mqtt.positions.deadband: '-1' is not within 0"},
      {" {host: b, positions: {interval: 2s, longest: 1s}}", "mqtt.positions.longest: is from interval to 1d"},
      {" {host: b, positions: {devices: {axis2: {}}}}", "there is no device 'axis2'; did you mean 'axis1'?"},
      {" {host: b, queue: {messages: 5}}", "mqtt.queue.messages: '5' is not within 100"},
      {" {host: b, queue: {size: 5}}", "mqtt.queue.size: '5' is not a size"},
      {" {host: b, queue: {size: 5kB}}", "mqtt.queue: size is at least 256kB"},
  };
  for (const auto& mistake : mistakes) {
    ConfigErrors errors("m.yaml");
    EXPECT_FALSE(Parse(mistake.mqtt, errors)) << mistake.mqtt;
    EXPECT_THAT(errors.Text(), HasSubstr(mistake.message)) << mistake.mqtt;
  }
}

TEST(LoadMqtt, ReadsSparkplug) {
  EXPECT_FALSE(Mqtt(" {host: b}").sparkplug);
  const MqttConfig mqtt = Mqtt(" {host: b, sparkplug: {group: plant}}");
  ASSERT_TRUE(mqtt.sparkplug);
  EXPECT_EQ(mqtt.sparkplug->node, "") << "the machine's name";
  EXPECT_EQ(mqtt.sparkplug->outbox_bytes, 256 << 20);
  const auto all =
      Mqtt(
          " {host: b, sparkplug: {group: plant, node: press, primary_host: scada1, outbox: {directory: /var/x, "
          "size: 2MB, fsync_ms: 50, repeat: 3s}}}")
          .sparkplug;
  ASSERT_TRUE(all);
  EXPECT_EQ(all->group + all->node + all->primary_host + all->directory, "plantpressscada1/var/x");
  EXPECT_EQ(all->outbox_bytes, 2 << 20);
  EXPECT_EQ(all->sync, 50 * kMillisecond);
  EXPECT_EQ(all->repeat, 3 * kSecond);
}

TEST(LoadMqtt, SparkplugNamesAreLevelsOfTopics) {
  const auto error = [](const std::string& keys) {
    ConfigErrors errors("m.yaml");
    static_cast<void>(Parse(" {host: b, sparkplug: {" + keys + "}}", errors));
    return errors.Text();
  };
  EXPECT_EQ(error("group: 'Werk Süd 3'"), "");
  EXPECT_THAT(error(""), HasSubstr("group"));
  for (const char* bad : {"a/b", "a+", "#", "\\x01", "\\x7f"}) {
    EXPECT_THAT(error(std::string("group: \"") + bad + '"'), HasSubstr("group is 1 to 64")) << bad;
    EXPECT_THAT(error(std::string("group: g, node: \"") + bad + '"'), HasSubstr("node is 1 to 64")) << bad;
    EXPECT_THAT(error(std::string("group: g, primary_host: \"") + bad + '"'), HasSubstr("primary_host is")) << bad;
  }
  EXPECT_THAT(error("group: " + std::string(65, 'g')), HasSubstr("group is 1 to 64"));
  EXPECT_THAT(error("group: g, outbox: {size: 500kB}"), HasSubstr("at least 1MB"));
  EXPECT_THAT(error("group: g, outbox: {repeat: 2h}"), HasSubstr("at most 1h"));
}

}  // namespace

}  // namespace axlecast
