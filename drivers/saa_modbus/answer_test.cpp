// Which replies have come.
#include "drivers/saa_modbus/operations.h"

#include <gtest/gtest.h>

#include "tests/support/golden_file.h"

namespace axlecast::saa_modbus {
namespace {

Answer Answered(Event::Kind kind, const char* reply, int bits = 14) {
  const auto request = GoldenBytes("01 03 00 00 00 01 84 0A");
  const auto bytes = GoldenBytes(reply);
  return Interpret({.kind = kind, .sent = {}, .received = {}, .request = request, .bytes = bytes}, bits);
}

TEST(Answer, ItsOwnReplyHasComeHoweverDamaged) {
  constexpr auto kReply = Event::Kind::kReply;
  EXPECT_TRUE(Answered(kReply, "01 03 02 01 7F F8 34").ok());
  EXPECT_FALSE(Answered(kReply, "01 03 02 01 7F F8 34").unanswered);
  EXPECT_FALSE(Answered(kReply, "01 03 02 01 7E F8 34").unanswered) << "a damaged byte";
  EXPECT_FALSE(Answered(kReply, "01 03 02 40 00 89 84").unanswered) << "out of range";
}

TEST(Answer, WhateverElseComesTheReplyMayStillFollow) {
  constexpr auto kReply = Event::Kind::kReply;
  constexpr auto kTimeout = Event::Kind::kTimeout;
  const auto kind = [](const Answer& answer) { return answer.error; };
  for (const auto& [answer, error] : {
           std::pair{Answered(kTimeout, ""), ErrorKind::kTimeout},
           {Answered(kTimeout, "01 03 02 01"), ErrorKind::kShort},
           {Answered(kTimeout, "01 03 02 01 7F F8 34"), ErrorKind::kShort},
           {Answered(kReply, "06 03 02 01 7F 4D F4"), ErrorKind::kWrongEcho},
           {Answered(kReply, "01 03 04 00 00 01 7F BA 43"), ErrorKind::kWrongEcho},
           {Answered(kReply, "01 83 02 C0 F1"), ErrorKind::kException},
           {Answered(kReply, "05 03 02 01 7E F8 34"), ErrorKind::kChecksum},
           {Answered(kReply, "01 03 04 01 7E F8 34 00 00"), ErrorKind::kChecksum},
       }) {
    EXPECT_EQ(kind(answer), error);
    EXPECT_TRUE(answer.unanswered) << ErrorName(error);
  }
}

}  // namespace
}  // namespace axlecast::saa_modbus
