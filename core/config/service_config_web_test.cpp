#include "core/config/service_config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/config/load.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::optional<MachineConfig> Parse(const std::string& web, ConfigErrors& errors) {
  return ParseConfig(
      "machine: press3\nweb: " + web + "\nbuses:\n  b0: {family: point, simulate: true, devices: {axis1: {}}}\n",
      errors);
}

std::string Mistake(const std::string& web) {
  ConfigErrors errors("m.yaml");
  EXPECT_FALSE(Parse(web, errors)) << web;
  return errors.Text();
}

TEST(LoadWeb, ServesThisHostOnlyWhereNothingIsSaid) {
  ConfigErrors errors("m.yaml");
  const auto machine = Parse("{}", errors);
  ASSERT_TRUE(machine) << errors.Text();
  EXPECT_EQ(machine->web.bind, "127.0.0.1");
  EXPECT_EQ(machine->web.port, 8380);
  EXPECT_TRUE(machine->web.token.empty());
}

TEST(LoadWeb, ReadsEveryKey) {
  ConfigErrors errors("m.yaml");
  const auto machine = Parse(
      "{bind: '::', port: 443, tls_cert: /etc/c.pem, tls_key: /etc/k.pem, token: {file: /etc/t}, names: "
      "[press3.local], fleet: {database: host=db1 dbname=axlecast, password: {file: /etc/p}}}",
      errors);
  ASSERT_TRUE(machine) << errors.Text();
  const WebConfig& web = machine->web;
  EXPECT_EQ(web.bind, "::");
  EXPECT_EQ(web.port, 443);
  EXPECT_EQ(web.certificate, "/etc/c.pem");
  EXPECT_EQ(web.key, "/etc/k.pem");
  EXPECT_EQ(web.token.file, "/etc/t");
  EXPECT_THAT(web.names, ElementsAre("press3.local"));
  EXPECT_EQ(web.fleet_database, "host=db1 dbname=axlecast");
  EXPECT_EQ(web.fleet_password.file, "/etc/p");
}

TEST(LoadWeb, RefusesAnAddressOfOthersWithoutTlsAndToken) {
  EXPECT_THAT(Mistake("{bind: 0.0.0.0, token: {file: /etc/t}}"), HasSubstr("needs tls_cert and tls_key"));
  EXPECT_THAT(Mistake("{bind: 192.168.1.5, tls_cert: /c, tls_key: /k}"), HasSubstr("needs a token"));
  EXPECT_THAT(Mistake("{bind: '::'}"), HasSubstr("m.yaml:2"));
}

TEST(LoadWeb, NamesEachMistake) {
  EXPECT_THAT(Mistake("{bind: eth0}"), HasSubstr("'eth0' is no address"));
  EXPECT_THAT(Mistake("{tls_cert: /c}"), HasSubstr("needs tls_key beside it"));
  EXPECT_THAT(Mistake("{tls_key: k.pem, tls_cert: /c}"), HasSubstr("'k.pem' is no absolute path"));
  EXPECT_THAT(Mistake("{port: 0}"), HasSubstr("port"));
  EXPECT_THAT(Mistake("{adress: 127.0.0.1}"), HasSubstr("adress"));
  EXPECT_THAT(Mistake("{fleet: {}}"), HasSubstr("database"));
  EXPECT_THAT(Mistake("{fleet: {database: x, password: secret}}"),
              AllOf(HasSubstr("/etc/axlecast/fleet.password"), Not(HasSubstr("secret"))));
}

TEST(WebConfig, KnowsWhatOnlyThisHostReaches) {
  for (const char* address : {"127.0.0.1", "127.1.2.3", "::1"}) EXPECT_TRUE(IsLoopback(address)) << address;
  for (const char* address : {"0.0.0.0", "::", "10.0.0.1", "128.0.0.1", "::2", "localhost", ""}) {
    EXPECT_FALSE(IsLoopback(address)) << address;
  }
}

TEST(WebConfig, SaysWhatABrowserOpens) {
  EXPECT_EQ(WebUrl({}, "press3"), "http://127.0.0.1:8380/");
  EXPECT_EQ(WebUrl({.bind = "::1", .port = 81}, "press3"), "http://[::1]:81/");
  EXPECT_EQ(WebUrl({.bind = "::", .port = 443, .certificate = "/c", .key = "/k"}, "press3"), "https://press3:443/");
}

}  // namespace

}  // namespace axlecast
