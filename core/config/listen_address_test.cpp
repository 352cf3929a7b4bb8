#include "core/config/listen_address.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace axlecast {
namespace {

using ::testing::HasSubstr;

std::string Read(std::string_view text) {
  const Result<ListenAddress> listen = ParseListenAddress(text);
  return listen ? listen->address + " " + std::to_string(listen->port) : listen.error().text;
}

TEST(ParseListenAddress, APortAloneIsOfThisHostOnly) { EXPECT_EQ(Read("8381"), "127.0.0.1 8381"); }

TEST(ParseListenAddress, AnotherAddressIsGivenExplicitly) {
  EXPECT_EQ(Read("192.0.2.7:1"), "192.0.2.7 1");
  EXPECT_EQ(Read("0.0.0.0:65535"), "0.0.0.0 65535");
  EXPECT_EQ(Read("[2001:db8::1]:8381"), "2001:db8::1 8381");
}

TEST(ParseListenAddress, NamesMistakes) {
  for (const char* text : {"", "0", "65536", "-1", "+1", " 8381", "8381 ", "0x10", "127.0.0.1:", "[::1]:"}) {
    EXPECT_THAT(Read(text), HasSubstr("has no port from 1 to 65535")) << text;
  }
  for (const char* text : {":8381", "::1", "::1:8381", "[::1:8381", "[127.0.0.1]:8381", "[]:8381", "press3:8381",
                           "127.1:8381", "[[::1]]:8381", "127.0.0.1 :8381"}) {
    EXPECT_THAT(Read(text), HasSubstr("does not begin with an address")) << text;
  }
  using std::string_view_literals::operator""sv;
  EXPECT_THAT(Read("127.0.0.1\0x:8381"sv), HasSubstr("does not begin with an address"));
}

TEST(ListenAddressText, ReadsBack) {
  for (const char* text : {"127.0.0.1:8381", "[::]:8381"}) {
    EXPECT_EQ(ListenAddressText(ParseListenAddress(text).value()), text);
  }
}

}  // namespace
}  // namespace axlecast
