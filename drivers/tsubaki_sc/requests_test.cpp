#include "drivers/tsubaki_sc/requests.h"

#include <gmock/gmock.h>
#include <axlecast/command_status_t.hpp>

#include "drivers/tsubaki_sc/unit_test_support.h"

namespace axlecast::tsubaki_sc {
namespace {

constexpr MonoNs kCharacter = INT64_C(11'000'000'000) / 9'600;  // 8E1: 11 bits

Answer AnswerOf(const ByteList& request, const ByteList& reply, Event::Kind kind = Event::Kind::kReply) {
  return Interpret({.kind = kind, .sent = {}, .received = {}, .request = request, .bytes = reply}, 0);
}

// Guideline 12: version 01 00, without a byte count.
TEST(Answer, ReadsTheVersionWithoutAByteCount) {
  const ByteList request = WithCrc({5, 0x11});
  const ByteList reply = WithCrc({5, 0x11, 0x01, 0x00});
  const Answer answer = AnswerOf(request, reply);
  ASSERT_TRUE(answer.ok());
  EXPECT_THAT(answer.reply.data, testing::ElementsAre(0x01, 0x00));
  EXPECT_EQ(AnswerOf(request, WithCrc({6, 0x11, 0x01, 0x00})).error, ErrorKind::kWrongEcho);
  EXPECT_EQ(AnswerOf(request, {5, 0x11, 0x01, 0x00, 0x00, 0x00}).error, ErrorKind::kChecksum);
  const Answer refused = AnswerOf(request, WithCrc({5, 0x91, 0x01}));
  EXPECT_EQ(refused.error, ErrorKind::kException);
  EXPECT_EQ(CauseOf(refused), "error 01 (function error)");
}

// Guideline 10, AI 300: 0000 or FF00.
TEST(Answer, TheLoginStatusHasTwoValues) {
  const ByteList request = WithCrc({1, 0x04, 0x01, 0x2C, 0x00, 0x01});
  EXPECT_TRUE(AnswerOf(request, WithCrc({1, 0x04, 0x02, 0x00, 0x00})).ok());
  EXPECT_TRUE(AnswerOf(request, WithCrc({1, 0x04, 0x02, 0xFF, 0x00})).ok());
  EXPECT_EQ(AnswerOf(request, WithCrc({1, 0x04, 0x02, 0x00, 0xFF})).error, ErrorKind::kRange);
}

TEST(Answer, IsUnclearUnlessItIsTheReplyOrARefusal) {
  const ByteList request = WithCrc({1, 0x04, 0x00, 0xC8, 0x00, 0x01});
  const ByteList good = WithCrc({1, 0x04, 0x02, 0x00, 0x07});
  EXPECT_FALSE(AnswerOf(request, good).unclear);
  EXPECT_FALSE(AnswerOf(request, WithCrc({1, 0x84, 0x02})).unclear);
  EXPECT_TRUE(AnswerOf(request, {}, Event::Kind::kTimeout).unclear);
  EXPECT_TRUE(AnswerOf(request, WithCrc({2, 0x04, 0x02, 0x00, 0x07})).unclear);
  ByteList damaged = good;
  damaged[3] ^= 1U;
  EXPECT_TRUE(AnswerOf(request, damaged).unclear);
  const Answer late = AnswerOf(request, good, Event::Kind::kTimeout);
  EXPECT_EQ(late.error, ErrorKind::kShort);
  EXPECT_TRUE(late.unclear);
}

TEST(Answer, OnlyError04SpeaksOfTheLogin) {
  const ByteList request = WithCrc({1, 0x05, 0x00, 0x64, 0xFF, 0x00});
  EXPECT_TRUE(AnswerOf(request, WithCrc({1, 0x85, 0x04})).refused_for_login());
  EXPECT_FALSE(AnswerOf(request, WithCrc({1, 0x85, 0x03})).refused_for_login());
  EXPECT_FALSE(AnswerOf(request, request).refused_for_login());
  EXPECT_EQ(ErrorOf(AnswerOf(request, WithCrc({1, 0x85, 0x03}))).reason, command_status_t::REASON_DEVICE_REFUSED);
  EXPECT_EQ(ErrorOf(AnswerOf(request, {}, Event::Kind::kTimeout)).reason, command_status_t::REASON_NO_REPLY);
}

// The unit acts between the last bit of the request and the first of its reply.
TEST(Answer, HoldsTheInstantAtWhichTheUnitActed) {
  const ByteList request = WithCrc({1, 0x04, 0x00, 0xC8, 0x00, 0x01});
  const ByteList reply = WithCrc({1, 0x04, 0x02, 0x00, 0x07});
  const MonoNs sent = 1'000 * kSecond;
  const MonoNs request_end = sent + 8 * kCharacter;
  const MonoNs reply_begin = request_end + 7 * kMillisecond;
  const MonoNs reply_end = reply_begin + 7 * kCharacter;
  const Answer answer = Interpret({.kind = Event::Kind::kReply,
                                   .sent = {sent, sent + 20 * kMicrosecond},
                                   .received = {reply_begin + kCharacter, reply_end},
                                   .request = request,
                                   .bytes = reply},
                                  kCharacter);
  EXPECT_EQ(answer.at.first, request_end);
  EXPECT_EQ(answer.at.last, reply_begin);
  EXPECT_EQ(answer.end, reply_end);
  // If an adapter hands the reply over in one piece, its begin is less exact; the wire time gives the rest.
  const Answer whole = Interpret({.kind = Event::Kind::kReply,
                                  .sent = {sent, sent},
                                  .received = {reply_end + kMillisecond, reply_end + kMillisecond},
                                  .request = request,
                                  .bytes = reply},
                                 kCharacter);
  EXPECT_EQ(whole.at.last, reply_begin + kMillisecond);
}

}  // namespace

}  // namespace axlecast::tsubaki_sc
