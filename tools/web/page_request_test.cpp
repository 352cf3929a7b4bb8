#include "tools/web/page_request.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace axlecast {
namespace {

using ::testing::HasSubstr;

template <typename Request>
Request As(std::string_view text) {
  const PageRequest request = ParsePageRequest(text);
  EXPECT_TRUE(std::holds_alternative<Request>(request)) << text;
  return std::holds_alternative<Request>(request) ? std::get<Request>(request) : Request{};
}

TEST(PageRequest, IsUnderstood) {
  EXPECT_EQ(As<SubscribeRequest>(R"({"type":"subscribe","devices":["axis1","gm1"],"history_s":120})"),
            (SubscribeRequest{{"axis1", "gm1"}, 120}));
  EXPECT_EQ(As<SubscribeRequest>(R"({"devices":[],"type":"subscribe","later":{"a":1}})"), SubscribeRequest{});
  EXPECT_EQ(As<SeekRequest>(R"({"type":"seek","utime":1790000000000001})"), SeekRequest{1'790'000'000'000'001});
  EXPECT_EQ(As<PlayRequest>(R"({"type":"play"})"), PlayRequest{true});
  EXPECT_EQ(As<PlayRequest>(R"({"type":"pause"})"), PlayRequest{false});
  EXPECT_EQ(As<SpeedRequest>(R"({"type":"speed","factor":2.5})"), SpeedRequest{2.5});
}

TEST(PageRequest, IsRefusedWithWhatIsWrong) {
  EXPECT_THAT(As<BadRequest>("").text, HasSubstr("no JSON object"));
  EXPECT_THAT(As<BadRequest>("[1]").text, HasSubstr("no JSON object"));
  EXPECT_THAT(As<BadRequest>("{}").text, HasSubstr("without a type"));
  EXPECT_THAT(As<BadRequest>(R"({"type":7})").text, HasSubstr("without a type"));
  EXPECT_THAT(As<BadRequest>(R"({"type":"command","operation":"zero"})").text, HasSubstr("only shows"));
  EXPECT_THAT(As<BadRequest>(R"({"type":"subscribe"})").text, HasSubstr("no list"));
  EXPECT_THAT(As<BadRequest>(R"({"type":"subscribe","devices":[1]})").text, HasSubstr("no list"));
  EXPECT_THAT(As<BadRequest>(R"({"type":"subscribe","devices":[],"history_s":-1})").text, HasSubstr("history_s"));
  EXPECT_THAT(As<BadRequest>(R"({"type":"seek","utime":"now"})").text, HasSubstr("utime"));
  EXPECT_THAT(As<BadRequest>(R"({"type":"seek","utime":1e300})").text, HasSubstr("utime"));
  EXPECT_THAT(As<BadRequest>(R"({"type":"speed","factor":0})").text, HasSubstr("factor"));
  EXPECT_THAT(As<BadRequest>(R"({"type":"speed"})").text, HasSubstr("factor"));
}

TEST(PageRequest, OfDeepNestingIsRefused) {
  EXPECT_THAT(As<BadRequest>(std::string(100'000, '[')).text, HasSubstr("no JSON object"));
  EXPECT_THAT(
      As<BadRequest>(R"({"type":"subscribe","devices":)" + std::string(8000, '[') + std::string(8000, ']') + '}')
          .text,
      HasSubstr("no list"));
}

TEST(PageRequest, OfTooManyDevicesIsRefused) {
  std::string devices;
  for (std::size_t i = 0; i <= kMaxSubscribed; ++i) devices += (i == 0 ? "\"d" : ",\"d") + std::to_string(i) + '"';
  EXPECT_THAT(As<BadRequest>(R"({"type":"subscribe","devices":[)" + devices + "]}").text, HasSubstr("too many"));
}

}  // namespace
}  // namespace axlecast
