#include "bridge/access/admission.h"

#include <gtest/gtest.h>
#include <string>
#include <vector>

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
  for (std::size_t i = 0; i < kIssued; ++i) fit += Fits(prepared, i) ? 1U : 0U;
  EXPECT_EQ(fit, PreparedCommands::kMax);
  prepared.Issue(TokenOf(kIssued), {.who = "anna", .device = "axis1", .operation = "", .arguments = {}}, kSecond);
  EXPECT_TRUE(Fits(prepared, kIssued));
  EXPECT_FALSE(Fits(prepared, kIssued)) << "once";
}

TEST(PreparedCommands, AreCommittedAsTheyWerePrepared) {
  const auto fits = [](const std::string& operation, const std::vector<argument_t>& arguments) {
    PreparedCommands prepared;
    prepared.Issue(TokenOf(1),
                   {.who = "anna", .device = "axis1", .operation = "write", .arguments = {{"address", "3"}}},
                   kSecond);
    command_body_t body{};
    body.token[0] = 1;
    body.device = "axis1";
    body.operation = operation;
    body.arguments = arguments;
    return prepared.Redeem(body, "anna", kSecond).has_value();
  };
  EXPECT_TRUE(fits("write", {{"address", "3"}}));
  EXPECT_FALSE(fits("mark", {{"address", "3"}}));
  EXPECT_FALSE(fits("write", {{"address", "4"}}));
  EXPECT_FALSE(fits("write", {{"page", "3"}}));
  EXPECT_FALSE(fits("write", {}));
  EXPECT_FALSE(fits("write", {{"address", "3"}, {"address", "3"}}));
}

TEST(UnauthorizedMessageCounter, IsLoggedEveryTenSecondsAndRecentForAMinute) {
  UnauthorizedMessageCounter counter;
  EXPECT_FALSE(counter.Recent(kSecond)) << "none has come";
  EXPECT_TRUE(counter.Count(kSecond));
  EXPECT_FALSE(counter.Count(kSecond + UnauthorizedMessageCounter::kLogInterval - 1));
  EXPECT_TRUE(counter.Count(kSecond + UnauthorizedMessageCounter::kLogInterval));
  EXPECT_EQ(counter.count(), 3);
  const MonoNs last = kSecond + UnauthorizedMessageCounter::kLogInterval;
  EXPECT_TRUE(counter.Recent(last + UnauthorizedMessageCounter::kRecent - 1));
  EXPECT_FALSE(counter.Recent(last + UnauthorizedMessageCounter::kRecent));
}

}  // namespace

}  // namespace axlecast
