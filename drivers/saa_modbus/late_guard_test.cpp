// What may be asked while a reply is still on its way, and which replies have come.
#include "drivers/saa_modbus/late_guard.h"

#include <gtest/gtest.h>

#include "tests/support/golden_file.h"

namespace axlecast::saa_modbus {
namespace {

constexpr MonoNs kLate = 200 * kMillisecond;

SaaModbusSettings Settings(int bits) {
  SaaModbusSettings settings;
  settings.bits = bits;
  settings.registers = bits > 16 ? 2 : 1;
  settings.late = kLate;
  return settings;
}

Answer Unanswered(int registers) {
  Answer answer;
  answer.asked = {.address = 1, .registers = static_cast<std::uint8_t>(registers)};
  answer.error = ErrorKind::kTimeout;
  answer.unanswered = true;
  return answer;
}

TEST(LateGuard, AsksForTheOtherNumberOfRegistersAtOnce) {
  const SaaModbusSettings settings = Settings(16);
  LateGuard guard(settings);
  EXPECT_EQ(guard.Next(0).registers, 1);
  guard.On(Unanswered(1), kSecond);
  EXPECT_EQ(guard.Next(kSecond).registers, 2);
  EXPECT_LE(guard.Next(kSecond).not_before, kSecond);
  EXPECT_EQ(guard.Next(kSecond + kLate).registers, 1) << "as before, once it can be late no more";
}

TEST(LateGuard, LeavesTheEncoderAloneWhenBothAreOnTheirWay) {
  const SaaModbusSettings settings = Settings(16);
  LateGuard guard(settings);
  guard.On(Unanswered(1), kSecond);
  guard.On(Unanswered(2), kSecond + 50 * kMillisecond);
  const LateGuard::Choice choice = guard.Next(kSecond + 50 * kMillisecond);
  EXPECT_EQ(choice.registers, 1);
  EXPECT_EQ(choice.not_before, kSecond + kLate);
}

TEST(LateGuard, AboveSixteenBitsThereIsNoOtherWayToAsk) {
  const SaaModbusSettings settings = Settings(17);
  LateGuard guard(settings);
  guard.On(Unanswered(2), kSecond);
  EXPECT_EQ(guard.Next(kSecond).registers, 2);
  EXPECT_EQ(guard.Next(kSecond).not_before, kSecond + kLate);
  guard.Forget();
  EXPECT_EQ(guard.Next(kSecond).not_before, 0) << "the line was closed";
}

TEST(LateGuard, AnAnswerAndOtherFunctionsBlockNothing) {
  const SaaModbusSettings settings = Settings(17);
  LateGuard guard(settings);
  Answer answer = Unanswered(2);
  answer.error.reset();
  answer.unanswered = false;
  guard.On(answer, kSecond);
  Answer query = Unanswered(0);
  query.asked.function = kQueryAddress;
  guard.On(query, kSecond);
  EXPECT_EQ(guard.Next(kSecond).not_before, 0);
}

// ---- which replies have come ----

Answer Outcome(Event::Kind kind, const char* reply, int bits = 14) {
  const auto request = GoldenBytes("01 03 00 00 00 01 84 0A");
  const auto bytes = GoldenBytes(reply);
  return Interpret({.kind = kind, .sent = {}, .received = {}, .request = request, .bytes = bytes}, bits);
}

TEST(Answer, ItsOwnReplyHasComeHoweverDamaged) {
  constexpr auto kReply = Event::Kind::kReply;
  EXPECT_TRUE(Outcome(kReply, "01 03 02 01 7F F8 34").ok());
  EXPECT_FALSE(Outcome(kReply, "01 03 02 01 7F F8 34").unanswered);
  EXPECT_FALSE(Outcome(kReply, "01 03 02 01 7E F8 34").unanswered) << "a damaged byte";
  EXPECT_FALSE(Outcome(kReply, "01 03 02 40 00 89 84").unanswered) << "out of range";
}

TEST(Answer, WhateverElseComesTheReplyMayStillFollow) {
  constexpr auto kReply = Event::Kind::kReply;
  constexpr auto kTimeout = Event::Kind::kTimeout;
  const auto kind = [](const Answer& answer) { return answer.error; };
  for (const auto& [answer, error] : {
           std::pair{Outcome(kTimeout, ""), ErrorKind::kTimeout},
           {Outcome(kTimeout, "01 03 02 01"), ErrorKind::kShort},
           {Outcome(kTimeout, "01 03 02 01 7F F8 34"), ErrorKind::kShort},
           {Outcome(kReply, "06 03 02 01 7F 4D F4"), ErrorKind::kWrongEcho},
           {Outcome(kReply, "01 03 04 00 00 01 7F BA 43"), ErrorKind::kWrongEcho},
           {Outcome(kReply, "01 83 02 C0 F1"), ErrorKind::kException},
           {Outcome(kReply, "05 03 02 01 7E F8 34"), ErrorKind::kChecksum},
           {Outcome(kReply, "01 03 04 01 7E F8 34 00 00"), ErrorKind::kChecksum},
       }) {
    EXPECT_EQ(kind(answer), error);
    EXPECT_TRUE(answer.unanswered) << ErrorName(error);
  }
}

}  // namespace
}  // namespace axlecast::saa_modbus
