#include "tools/service/masked_yaml.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(MaskedYaml, KeepsWhatIsNoSecret) {
  EXPECT_EQ(MaskedYaml("machine: press3\nbuses:\n  b0: {poll_hz: 1000, devices: {axis1: {unit: mm}}}\n"),
            "machine: press3\nbuses:\n  b0:\n    poll_hz: 1000\n    devices:\n      axis1:\n        unit: mm\n");
}

TEST(MaskedYaml, MasksPasswordsWhereverTheyStand) {
  const std::string masked = MaskedYaml(
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

TEST(MaskedYaml, SaysWhereASecretIsKept) {
  EXPECT_THAT(MaskedYaml("passwords: {main: {file: /etc/axlecast/pw}, other: {credential: gm}}\n"),
              ::testing::AllOf(HasSubstr("/etc/axlecast/pw"), HasSubstr("credential: gm")));
}

TEST(MaskedYaml, OfWhatIsNoYamlNothingIsShown) {
  EXPECT_THAT(MaskedYaml("password: 'geheim"), Not(HasSubstr("geheim")));
  EXPECT_THAT(MaskedYaml("a: &x [*x]"), Not(HasSubstr("*x")));
}

}  // namespace
}  // namespace axlecast
