#include "core/base/secret.h"

#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <new>
#include <string_view>
#include <utility>

namespace axlecast {
namespace {

// Short enough to be stored within the object, where a test can look for its rest.
constexpr std::string_view kShort = "tr0ub4dor";

// Memory in which an object lives and that outlives it.
template <typename Object = Secret>
struct Place {
  template <typename... Arguments>
  Object* Make(Arguments&&... arguments) {
    return new (bytes.data()) Object(std::forward<Arguments>(arguments)...);
  }
  [[nodiscard]] bool Holds(std::string_view text) const {
    return std::string_view(bytes.data(), bytes.size()).find(text) != std::string_view::npos;
  }

  alignas(Object) std::array<char, sizeof(Object)> bytes{};
};

TEST(Secret, HoldsItsText) {
  EXPECT_EQ(Secret().text(), "");
  EXPECT_EQ(Secret(std::string(kShort)).text(), kShort);
  const std::string with_zero("a\0b", 3);
  EXPECT_EQ(Secret(with_zero).text(), with_zero);
}

TEST(Secret, LeavesNothingBehindWhenItGoes) {
  Place<> place;
  Secret* const secret = place.Make(std::string(kShort));
  ASSERT_TRUE(place.Holds(kShort));
  std::destroy_at(secret);
  EXPECT_FALSE(place.Holds(kShort.substr(1, 3)));
}

TEST(Secret, MovesAndLeavesNothingWhereItWas) {
  Place<> place;
  Secret* const first = place.Make(std::string(kShort));
  Secret second(std::move(*first));
  EXPECT_EQ(second.text(), kShort);
  EXPECT_FALSE(place.Holds(kShort.substr(1, 3)));
  EXPECT_EQ(first->text(), "");
  *first = std::move(second);
  EXPECT_EQ(first->text(), kShort);
  Secret third;
  third = std::move(*first);
  EXPECT_EQ(third.text(), kShort);
  EXPECT_FALSE(place.Holds(kShort.substr(1, 3)));
  std::destroy_at(first);
}

TEST(Secret, WhatANewOneReplacesIsWiped) {
  Place<> place;
  Secret* const secret = place.Make(std::string(kShort));
  *secret = Secret(std::string("x"));
  EXPECT_EQ(secret->text(), "x");
  EXPECT_FALSE(place.Holds(kShort.substr(1, 3)));
  Secret& same = *secret;
  *secret = std::move(same);
  EXPECT_EQ(secret->text(), "x");
  std::destroy_at(secret);
}

TEST(Secret, AResultLeavesNothingBehindWhenItIsMovedOrDestroyed) {
  Place<Result<Secret>> place;
  Result<Secret>* const first = place.Make(Secret(std::string(kShort)));
  ASSERT_TRUE(place.Holds(kShort));
  Result<Secret> second(std::move(*first));
  EXPECT_EQ(second->text(), kShort);
  EXPECT_FALSE(place.Holds(kShort.substr(1, 3)));
  *first = std::move(second);
  ASSERT_TRUE(place.Holds(kShort));
  std::destroy_at(first);
  EXPECT_FALSE(place.Holds(kShort.substr(1, 3)));
}

}  // namespace

}  // namespace axlecast
