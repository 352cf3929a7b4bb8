#include "tools/axlecast/common/config_keys.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

const std::vector<ConfigKey> kKeys = {
    {.place = "machine", .kind = "text", .required = true},
    {.place = "buses.<name>.poll_hz", .kind = "number", .range = "0 to 20000 Hz", .fallback = "1000"},
    {.place = "buses.<name>.link", .kind = "mapping"},
    {.place = "buses.<name>.seen"},
};

TEST(ConfigKeys, TextIsALineEach) {
  EXPECT_EQ(ConfigKeysText(kKeys),
            "machine               text                  required\n"
            "buses.<name>.poll_hz  number                default 1000; 0 to 20000 Hz\n"
            "buses.<name>.link     mapping\n"
            "buses.<name>.seen     text\n");
}

TEST(ConfigKeys, JsonSaysNullWhereNothingIs) {
  const auto json = ConfigKeysJson(kKeys);
  ASSERT_EQ(json.size(), 4U);
  EXPECT_EQ(json[0].dump(), R"({"place":"machine","kind":"text","range":null,"default":null,"required":true})");
  EXPECT_EQ(json[1]["default"], "1000");
}

}  // namespace
}  // namespace axlecast
