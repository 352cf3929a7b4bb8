// Which request may be sent while replies of others may still come, and which replies are recognised.
#include "drivers/runtime/bus/stale_reply_guard.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace axlecast {
namespace {

constexpr MonoNs kBound = 500 * kMillisecond;
constexpr MonoNs kStart = 10 * kSecond;
using ByteList = std::vector<std::uint8_t>;

// A protocol for tests: a reply is its request's letter, a value, and the letter again; '!' instead of the value is a
// refusal that does not name the request.
constexpr std::uint8_t kRefused = '!';

ReplyMatch MatchLetters(Bytes request, Bytes reply) {
  if (reply.size() != 3) return ReplyMatch::kNo;
  if (reply[1] == kRefused) return ReplyMatch::kRefusal;
  if (reply[0] != request[0]) return ReplyMatch::kNo;
  return reply[2] == request[0] ? ReplyMatch::kYes : ReplyMatch::kDamaged;
}

Exchange Ask(char letter) {
  Exchange exchange{.request = {static_cast<std::uint8_t>(letter)}, .reply_length = &FixedLength<3>, .timeout = 1};
  exchange.shape = {.reply = static_cast<std::uint32_t>(letter), .refusal = kRefused, .match = &MatchLetters};
  return exchange;
}
Exchange AskAny(char letter) {
  Exchange exchange = Ask(letter);
  exchange.shape.interchangeable = true;
  return exchange;
}

class StaleReplyGuardTest : public testing::Test {
 protected:
  StaleReplyGuardTest() {
    guard_.AddDevice();
    guard_.AddDevice();
    guard_.Start(kStart - kBound);
  }
  [[nodiscard]] bool MaySend(const Exchange& exchange) const { return guard_.FreeAt(exchange, now_) <= now_; }
  void End(const Exchange& exchange, const ByteList& bytes, std::size_t device = 0,
           Event::Kind kind = Event::Kind::kReply) {
    guard_.Ended(exchange, device,
                 {.kind = bytes.empty() ? Event::Kind::kTimeout : kind,
                  .sent = {now_, now_},
                  .received = {now_, now_},
                  .request = exchange.request,
                  .bytes = bytes});
  }

  StaleReplyGuard guard_{kBound};
  MonoNs now_ = kStart;
};

TEST_F(StaleReplyGuardTest, AnAnsweredRequestHoldsNothing) {
  End(Ask('a'), {'a', 1, 'a'});
  EXPECT_EQ(guard_.held(), 0U);
  EXPECT_TRUE(MaySend(Ask('a')));
}

TEST_F(StaleReplyGuardTest, NoRequestOfTheSameShapeUntilTheBoundHasPassed) {
  End(Ask('a'), {});
  EXPECT_EQ(guard_.FreeAt(Ask('a'), now_), kStart + kBound);
  EXPECT_TRUE(MaySend(Ask('b')));
  now_ += kBound;
  EXPECT_TRUE(MaySend(Ask('a')));
}

TEST_F(StaleReplyGuardTest, StrangeBytesLeaveItUnanswered) {
  for (const ByteList& bytes : {ByteList{'x', 1, 'x'}, {'a', 1}, {1, 2, 3, 4}}) {
    End(Ask('a'), bytes, 0, Event::Kind::kTimeout);
    EXPECT_FALSE(MaySend(Ask('a')));
    now_ += kBound;
  }
}

TEST_F(StaleReplyGuardTest, ADamagedReplyOrARefusalHasCome) {
  End(Ask('a'), {'a', 1, 'x'});
  EXPECT_TRUE(MaySend(Ask('a')));
  End(Ask('a'), {'?', kRefused, '?'});
  EXPECT_TRUE(MaySend(Ask('a')));
}

// A refusal may be the other one's.
TEST_F(StaleReplyGuardTest, BehindAnotherOneARefusalMayBeTheOthers) {
  End(Ask('a'), {});
  End(Ask('b'), {'b', 1, 'x'});
  EXPECT_TRUE(MaySend(Ask('b'))) << "damaged, but its own";
  End(Ask('c'), {'?', kRefused, '?'});
  EXPECT_FALSE(MaySend(Ask('a')));
  EXPECT_FALSE(MaySend(Ask('c')));
}

// Replies may overtake each other.
TEST_F(StaleReplyGuardTest, AGoodReplySaysNothingOfOtherRequests) {
  End(Ask('a'), {});
  End(Ask('c'), {'c', 1, 'c'});
  EXPECT_FALSE(MaySend(Ask('a')));
  EXPECT_TRUE(MaySend(Ask('c')));
}

TEST_F(StaleReplyGuardTest, ALateReplyInPlaceOfAnotherLeavesTheYoungerOneUnanswered) {
  End(Ask('a'), {});
  End(Ask('b'), {'a', 1, 'a'});
  EXPECT_TRUE(MaySend(Ask('a')));
  EXPECT_FALSE(MaySend(Ask('b')));
  EXPECT_EQ(guard_.late(0), 1);
}

TEST_F(StaleReplyGuardTest, ALateReplyIsRecognisedAmongUnexpectedBytes) {
  End(Ask('a'), {});
  guard_.CameUnexpected(ByteList{'x', 'a'}, now_);
  EXPECT_FALSE(MaySend(Ask('a')));
  guard_.CameUnexpected(ByteList{7, 'a', 'x'}, now_);
  EXPECT_TRUE(MaySend(Ask('a')));
  EXPECT_EQ(guard_.late(0), 1);
}

TEST_F(StaleReplyGuardTest, TwoLateRepliesInOneRead) {
  End(Ask('a'), {});
  End(Ask('b'), {});
  guard_.CameUnexpected(ByteList{'a', 1, 'a', 'b', 2, 'b'}, now_);
  EXPECT_EQ(guard_.held(), 0U);
  EXPECT_EQ(guard_.late(0), 2);
}

TEST_F(StaleReplyGuardTest, AShapeThatARefusalLooksLikeIsHeldBackToo) {
  Exchange looks_refused = Ask('r');
  looks_refused.shape.reply = kRefused;
  End(Ask('a'), {});
  EXPECT_FALSE(MaySend(looks_refused));
}

TEST_F(StaleReplyGuardTest, AnExactRequestWaitsForRefusalsToo) {
  Exchange exact = Ask('w');
  exact.shape.exact = true;
  End(Ask('a'), {});
  EXPECT_FALSE(MaySend(exact));
}

// The reply may be that to the first.
TEST_F(StaleReplyGuardTest, AnInterchangeableRequestIsNeverHeldBackByItsLike) {
  End(AskAny('i'), {});
  ASSERT_TRUE(MaySend(AskAny('i')));
  End(AskAny('i'), {'i', 1, 'i'});
  EXPECT_EQ(guard_.held(), 1U) << "one of the two is not answered";
}

TEST_F(StaleReplyGuardTest, ALostLineLeavesTheRequestUnanswered) {
  guard_.Ended(Ask('a'), 0,
               {.kind = Event::Kind::kLinkDown, .sent = {}, .received = {now_, now_}, .request = {}, .bytes = {}});
  guard_.Start(now_);
  EXPECT_FALSE(MaySend(Ask('a')));
  EXPECT_TRUE(MaySend(Ask('b'))) << "what this process did is known";
}

TEST_F(StaleReplyGuardTest, AfterTheStartOnlyWhatNoEarlierProcessAskedFor) {
  StaleReplyGuard fresh(kBound);
  fresh.AddDevice();
  fresh.Start(now_);
  EXPECT_EQ(fresh.FreeAt(Ask('a'), now_), now_ + kBound);
  EXPECT_EQ(fresh.FreeAt(AskAny('i'), now_), now_);
  Exchange unique = Ask('u');
  unique.shape.fresh = true;
  EXPECT_EQ(fresh.FreeAt(unique, now_), now_);
  const ByteList reply = {'u', 1, 'u'};
  fresh.Ended(unique, 0,
              {.kind = Event::Kind::kReply,
               .sent = {now_, now_},
               .received = {now_, now_},
               .request = unique.request,
               .bytes = reply});
  EXPECT_EQ(fresh.FreeAt(Ask('a'), now_), now_);
}

TEST_F(StaleReplyGuardTest, ABroadcastIsNeverHeldBack) {
  Exchange broadcast = Ask('a');
  broadcast.reply_length = nullptr;
  End(Ask('a'), {});
  EXPECT_TRUE(MaySend(broadcast));
}

TEST_F(StaleReplyGuardTest, WithoutABoundNothingIsHeld) {
  StaleReplyGuard none(0);
  none.AddDevice();
  none.Start(now_);
  none.Ended(
      Ask('a'), 0,
      {.kind = Event::Kind::kTimeout, .sent = {now_, now_}, .received = {now_, now_}, .request = {}, .bytes = {}});
  EXPECT_EQ(none.FreeAt(Ask('a'), now_), now_);
}

TEST_F(StaleReplyGuardTest, AFullTableHoldsEverythingBack) {
  for (std::size_t i = 0; i <= StaleReplyGuard::kCapacity; ++i) {
    Exchange exchange = Ask('a');
    exchange.shape.reply = static_cast<std::uint32_t>(1'000 + i);
    End(exchange, {});
    now_ += kMicrosecond;
  }
  EXPECT_FALSE(MaySend(Ask('z')));
  now_ += kBound;
  EXPECT_TRUE(MaySend(Ask('z')));
}

// A device that sets no shape at all is safe.
TEST_F(StaleReplyGuardTest, WithoutAShapeOneExchangeAtATime) {
  Exchange plain{.request = {1}, .reply_length = &FixedLength<1>, .timeout = 1};
  End(plain, {7});
  EXPECT_TRUE(MaySend(plain));
  End(plain, {});
  EXPECT_FALSE(MaySend(plain));
}

}  // namespace
}  // namespace axlecast
