#include "tools/service/redacted_config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(RedactedConfig, KeepsWhatIsNoSecret) {
  EXPECT_EQ(RedactedConfig("machine: press3\nbuses:\n  b0: {poll_hz: 1000, devices: {axis1: {unit: mm}}}\n"),
            "machine: press3\nbuses:\n  b0:\n    poll_hz: 1000\n    devices:\n      axis1:\n        unit: mm\n");
}

TEST(RedactedConfig, MasksPasswordsWhereverTheyStand) {
  const std::string masked = RedactedConfig(
      "a: {simulate: {gm1: {password: \"geheim1\", voltage_v: 230}}}\n"
      "b: {Broker_Password: geheim2, api_token: [geheim3, geheim4]}\n"
      "c: {secret: {deep: {er: geheim5}}}\n"
      "d: {url: 'mqtts://user:geheim6@broker/'}\n"
      "# password: geheim7\n"
      "e: 5  # geheim8\n");
  EXPECT_THAT(masked, Not(HasSubstr("geheim")));
  EXPECT_THAT(masked, HasSubstr("voltage_v: 230"));
  EXPECT_THAT(masked, HasSubstr("mqtts://(masked)@broker/"));
  EXPECT_THAT(masked, HasSubstr("(masked)"));
}

TEST(RedactedConfig, SaysWhereASecretIsKept) {
  EXPECT_THAT(RedactedConfig("passwords: {main: {file: /etc/axlecast/pw}, other: {credential: gm}}\n"),
              ::testing::AllOf(HasSubstr("/etc/axlecast/pw"), HasSubstr("credential: gm")));
}

TEST(RedactedConfig, OfWhatIsNoYamlNothingIsShown) {
  EXPECT_THAT(RedactedConfig("password: 'geheim"), Not(HasSubstr("geheim")));
  EXPECT_THAT(RedactedConfig("a: &x [*x]"), Not(HasSubstr("*x")));
}

}  // namespace
}  // namespace axlecast
