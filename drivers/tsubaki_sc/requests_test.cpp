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

TEST(Answer, HasACauseInWords) {
  const ByteList request = WithCrc({1, 0x04, 0x00, 0xC8, 0x00, 0x01});
  EXPECT_EQ(CauseOf(AnswerOf(request, {}, Event::Kind::kTimeout)), "timeout");
  EXPECT_EQ(CauseOf(AnswerOf(request, WithCrc({1, 0x04, 0x02, 0x00, 0x07}))), "no error");
}

// ---- requests ----

constexpr MonoNs kTimeout = 30 * kMillisecond;

// Guideline 12: address, 11, version high and low, CRC; an error has five bytes.
TEST(Request, TheVersionsReplyHasSixBytes) {
  const Exchange exchange = Requests(5, kTimeout).Read(kVersion);
  EXPECT_EQ(exchange.timeout, kTimeout);
  EXPECT_EQ(exchange.reply_length({}), 0U);
  EXPECT_EQ(exchange.reply_length(ByteList{5}), 0U);
  EXPECT_EQ(exchange.reply_length(ByteList{5, 0x11}), 6U);
  EXPECT_EQ(exchange.reply_length(ByteList{5, 0x91}), 5U);
}

TEST(Request, TheVersionsReplyIsRecognised) {
  const Exchange exchange = Requests(5, kTimeout).Read(kVersion);
  const auto match = [&](const ByteList& reply) { return exchange.shape.match(exchange.request, reply); };
  EXPECT_EQ(match(WithCrc({5, 0x11, 0x01, 0x00})), ReplyMatch::kYes);
  EXPECT_EQ(match({5, 0x11, 0x01, 0x00, 0x00, 0x00}), ReplyMatch::kDamaged);
  EXPECT_EQ(match(WithCrc({6, 0x11, 0x01, 0x00})), ReplyMatch::kNo);
  EXPECT_EQ(match(WithCrc({5, 0x04, 0x01, 0x00})), ReplyMatch::kNo);
  EXPECT_EQ(match(WithCrc({5, 0x91, 0x01})), ReplyMatch::kRefusal);
}

TEST(Request, OnlyTheMainsAndAStopAreAsGoodWhenTheyAreLate) {
  const Requests requests(5, kTimeout);
  EXPECT_TRUE(requests.Read(kMains).shape.interchangeable);
  EXPECT_FALSE(requests.Read(kLoginStatus).shape.interchangeable);
  const Exchange stop = requests.SetCoil(kStopCoilAddress);
  EXPECT_TRUE(stop.shape.interchangeable);
  EXPECT_FALSE(stop.shape.exact) << "a stop is never held back";
  const Exchange other = requests.SetCoil(kStopCoilAddress + 1);
  EXPECT_FALSE(other.shape.interchangeable);
  EXPECT_TRUE(other.shape.exact);
}

// Guideline 10: the login is AO 100 to 107, written by function 16.
TEST(Request, ALoginIsAWriteToItsRegisters) {
  EXPECT_TRUE(IsLogin(ByteList{1, 0x10, 0x00, 100, 0x00, 8}));
  EXPECT_FALSE(IsLogin(ByteList{1, 0x10, 0x00, 100, 0x00}));
  EXPECT_FALSE(IsLogin(ByteList{1, 0x10}));
  EXPECT_FALSE(IsLogin({}));
  EXPECT_FALSE(IsLogin(ByteList{1, 0x03, 0x00, 100, 0x00, 8}));
  EXPECT_FALSE(IsLogin(ByteList{1, 0x10, 0x00, 101, 0x00, 8}));
  EXPECT_FALSE(IsLogin(ByteList{1, 0x10, 0x01, 100, 0x00, 8}));
}

}  // namespace

}  // namespace axlecast::tsubaki_sc
