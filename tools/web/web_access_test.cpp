#include "tools/web/web_access.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

const std::string kToken = "0123456789abcdef";

WebAccess Guarded(bool tls = true) {
  return WebAccess({.names = {"press3", "Press3.local"}, .tls = tls, .token_required = true}, Secret(kToken));
}

std::string CookieOf(const std::string& set_cookie) { return set_cookie.substr(0, set_cookie.find(';')); }

TEST(WebAccess, KnowsThisHostByItsAddressesAndNames) {
  const WebAccess access = Guarded();
  for (const char* host : {"localhost", "localhost:8380", "127.0.0.1:8380", "[::1]:8380", "192.168.1.5",
                           "press3:443", "PRESS3.LOCAL", "[fe80::1]"}) {
    EXPECT_TRUE(access.IsHost(host)) << host;
  }
  for (const char* host :
       {"", "evil.example", "evil.example:8380", "127.0.0.1.evil.example", "press3.evil.example",
        "localhost:", "localhost:80x", "localhost:123456", "[::1", "[::1]x", "::1", ":8380", "press3 "}) {
    EXPECT_FALSE(access.IsHost(host)) << host;
  }
}

TEST(WebAccess, TellsPagesOfOtherOrigins) {
  const WebAccess access = Guarded(false);
  const auto own = [&access](const char* origin) {
    return access.IsOwnOrigin({.host = "press3:8380", .origin = origin});
  };
  EXPECT_TRUE(own(""));
  EXPECT_TRUE(own("http://press3:8380"));
  EXPECT_TRUE(own("http://Press3:8380"));
  EXPECT_FALSE(own("https://press3:8380"));
  EXPECT_FALSE(own("http://press3"));
  EXPECT_FALSE(own("http://evil.example"));
  EXPECT_FALSE(own("null"));
}

TEST(WebAccess, TakesTheTokenAndNothingElse) {
  const WebAccess access = Guarded();
  EXPECT_TRUE(access.IsToken(kToken));
  for (const std::string& wrong :
       {std::string(), kToken + "0", kToken.substr(1), std::string("0123456789abcdeF")}) {
    EXPECT_FALSE(access.IsToken(wrong)) << wrong;
    EXPECT_FALSE(access.MayLook({.authorization = "Bearer " + wrong}, 0)) << wrong;
  }
  EXPECT_TRUE(access.MayLook({.authorization = "Bearer " + kToken}, 0));
  EXPECT_FALSE(access.MayLook({.authorization = "Basic " + kToken}, 0));
  EXPECT_FALSE(access.MayLook({}, 0));
}

TEST(WebAccess, WithoutATokenEverybodyMayLookAndNobodySignsIn) {
  const WebAccess access({}, Secret());
  EXPECT_TRUE(access.MayLook({}, 0));
  EXPECT_FALSE(access.IsToken(""));
}

TEST(WebAccess, ASessionLastsTwelveHours) {
  WebAccess access = Guarded();
  const std::string cookie = CookieOf(access.Open(kSecond));
  EXPECT_TRUE(access.MayLook({.cookie = "theme=dark; " + cookie + "; x=1"}, WebAccess::kSession));
  EXPECT_FALSE(access.MayLook({.cookie = cookie}, WebAccess::kSession + kSecond));
  EXPECT_FALSE(access.MayLook({.cookie = cookie + "0"}, 0));
  EXPECT_FALSE(access.MayLook({.cookie = "x" + cookie}, 0));
  EXPECT_FALSE(access.MayLook({.cookie = "axlecast_session="}, 0));
  EXPECT_NE(CookieOf(access.Open(0)), cookie);
}

TEST(WebAccess, ASessionsCookieIsKeptFromScriptsOtherSitesAndPlainHttp) {
  WebAccess access = Guarded();
  const std::string cookie = access.Open(0);
  for (const char* part : {"HttpOnly", "SameSite=Strict", "Secure", "Path=/"}) EXPECT_THAT(cookie, HasSubstr(part));
  WebAccess plain = Guarded(false);
  EXPECT_THAT(plain.Open(0), Not(HasSubstr("Secure")));
}

TEST(WebAccess, ForgetsTheOldestSessionWhereThereAreTooMany) {
  WebAccess access = Guarded();
  const std::string first = CookieOf(access.Open(0));
  const std::string second = CookieOf(access.Open(0));
  for (std::size_t i = 2; i <= WebAccess::kMaxSessions; ++i) static_cast<void>(access.Open(0));
  EXPECT_FALSE(access.MayLook({.cookie = first}, 0));
  EXPECT_TRUE(access.MayLook({.cookie = second}, 0));
}

TEST(WebForm, IsRead) {
  EXPECT_EQ(FormValue("token=a%2Bb+c%zz%4&x=1", "token"), "a+b c%zz%4");
  EXPECT_EQ(FormValue("x=1&token=abc", "token"), "abc");
  EXPECT_EQ(FormValue("xtoken=abc", "token"), "");
  EXPECT_EQ(FormValue("token", "token"), "");
  EXPECT_EQ(FormValue("", "token"), "");
  EXPECT_EQ(FormValue("token=%e2%82%ac", "token"), "\xe2\x82\xac");
  EXPECT_EQ(CookieValue("a=1;b=2 ; c=3", "b"), "2 ");
}

}  // namespace
}  // namespace axlecast
