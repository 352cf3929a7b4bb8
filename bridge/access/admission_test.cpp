#include "bridge/access/admission.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

Token TokenOf(std::size_t number) {
  Token token{};
  token[0] = static_cast<std::uint8_t>(number);
  token[1] = static_cast<std::uint8_t>(number >> 8U);
  return token;
}

bool Fits(PreparedCommands& prepared, std::size_t number) {
  command_body_t body{};
  const Token token = TokenOf(number);
  std::copy(token.begin(), token.end(), std::begin(body.token));
  body.device = "axis1";
  return prepared.Redeem(body, "anna", kSecond).has_value();
}

// Anybody who may prepare may do it without end.
TEST(PreparedCommands, KeepsTheNewestTokensAndNoMoreThanItMay) {
  PreparedCommands prepared;
  constexpr std::size_t kIssued = 1'000;
  for (std::size_t i = 0; i < kIssued; ++i) {
    prepared.Issue(TokenOf(i), {.who = "anna", .device = "axis1", .operation = "", .arguments = {}}, kSecond);
  }
  std::size_t fit = 0;
  for (std::size_t i = 0; i < kIssued; ++i) fit += Fits(prepared, i) ? 1 : 0;
  EXPECT_EQ(fit, PreparedCommands::kMax);
  prepared.Issue(TokenOf(kIssued), {.who = "anna", .device = "axis1", .operation = "", .arguments = {}}, kSecond);
  EXPECT_TRUE(Fits(prepared, kIssued));
  EXPECT_FALSE(Fits(prepared, kIssued)) << "once";
}

}  // namespace

}  // namespace axlecast
