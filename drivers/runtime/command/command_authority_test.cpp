#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <axlecast/command_status_t.hpp>
#include <string>

#include "drivers/runtime/command/command_authority.h"
#include "tests/support/counting_family.h"

namespace axlecast {
namespace {

using Verdict = EpochFence::Verdict;

TEST(EpochFence, OnlyWhatIsNewerThanEverythingCounts) {
  EpochFence fence;
  EXPECT_EQ(fence.Check(1, 0), Verdict::kOlder);
  EXPECT_EQ(fence.Check(1, 5), Verdict::kNewest);
  EXPECT_EQ(fence.Check(1, 5), Verdict::kOlder);
  EXPECT_EQ(fence.Check(1, 4), Verdict::kOlder);
  EXPECT_EQ(fence.Check(1, 6), Verdict::kNewest);
  EXPECT_EQ(fence.newest(), 6);
}

TEST(EpochFence, ABridgeNeverSeenBeforeMustBeAboveEveryOther) {
  EpochFence fence;
  EXPECT_EQ(fence.Check(1, 100), Verdict::kNewest);
  EXPECT_EQ(fence.Check(2, 1), Verdict::kOlder);
  EXPECT_EQ(fence.Check(2, 100), Verdict::kOlder);
  EXPECT_EQ(fence.newest(), 100);
  EXPECT_EQ(fence.Check(1, 101), Verdict::kNewest);  // the other has not taken over
  EXPECT_EQ(fence.Check(2, 102), Verdict::kNewest);
  EXPECT_EQ(fence.Check(1, 103), Verdict::kFenced);
  EXPECT_EQ(fence.newest(), 102);
}

TEST(EpochFence, ARecordingOfABridgeThatIsLongForgottenDoesNotAct) {
  EpochFence fence;
  for (std::int64_t boot = 1; boot <= 1'000; ++boot) EXPECT_EQ(fence.Check(boot, boot), Verdict::kNewest);
  for (std::int64_t boot = 1; boot < 1'000; ++boot) EXPECT_NE(fence.Check(boot, boot), Verdict::kNewest) << boot;
  EXPECT_EQ(fence.Check(999, 999), Verdict::kFenced);
  EXPECT_EQ(fence.Check(936, 936), Verdict::kFenced);
  EXPECT_EQ(fence.Check(935, 935), Verdict::kOlder)
      << "64 replaced bridges are remembered, however many are invented";
}

using ::testing::HasSubstr;

constexpr std::int64_t kUtime = 1'700'000'000'000'000;  // at MonoNs 0

class PermitBookTest : public testing::Test {
 protected:
  static permit_body_t Body(const std::string& device, std::int64_t issue, std::int32_t valid_ms) {
    permit_body_t body{};
    body.device = device;
    body.issuer_boot_id = 3;
    body.issue = issue;
    body.issued_utime = kUtime;
    body.valid_ms = valid_ms;
    body.operations = {"bump"};
    body.n_operations = 1;
    return body;
  }
  void Accept(const permit_body_t& body, MonoNs now = 0, const SigningKey* key = nullptr) {
    book_.Accept("axis1", Enveloped(body, key), now, kUtime + now / kMicrosecond);
  }
  [[nodiscard]] bool Holds(MonoNs now = 1) const { return book_.Check("axis1", "bump", now).has_value(); }
  [[nodiscard]] std::string Why(MonoNs now = kSecond) const {
    return book_.Check("axis1", "bump", now).error().text;
  }

  BusConfig bus_ = CountingBus("b0", {"axis1", "axis2"});
  PermitTable book_{bus_, UnsignedBridge()};
};

TEST_F(PermitBookTest, HoldsForItsTimeAndItsOperations) {
  EXPECT_FALSE(Holds());
  Accept(Body("axis1", 1, 500), kSecond);
  EXPECT_TRUE(Holds(kSecond + 500 * kMillisecond - 1));
  EXPECT_FALSE(Holds(kSecond + 500 * kMillisecond));
  EXPECT_FALSE(book_.Check("axis1", "write", kSecond).has_value());
  EXPECT_FALSE(book_.Check("axis2", "bump", kSecond).has_value());
}

TEST_F(PermitBookTest, AClockThatIsSetBackMakesNoCapturedPermitYoung) {
  constexpr MonoNs kHour = 3'600 * kSecond;
  permit_body_t seen = Body("axis1", 1, 500);
  Accept(seen);
  seen.issue = 3;
  seen.issued_utime = kUtime + kHour / kMicrosecond;
  Accept(seen, kHour);                             // the clock is right
  permit_body_t captured = Body("axis1", 4, 500);  // held back by somebody, and sent after the clock was set back
  captured.issued_utime = kUtime + kHour / kMicrosecond;
  captured.issuer_boot_id = 4;
  captured.issued_utime += 1'000'000;
  book_.Accept("axis1", Enveloped(captured), 2 * kHour, kUtime + kHour / kMicrosecond + 1'000'000);
  EXPECT_FALSE(Holds(2 * kHour + 1));
  book_.Accept("axis1", {}, 2 * kHour, kUtime + 2 * kHour / kMicrosecond);
  Accept(seen, 2 * kHour);
  book_.Accept("axis1", Enveloped(captured), 3 * kHour, kUtime + kHour / kMicrosecond + 1'000'000);
  EXPECT_FALSE(Holds(3 * kHour + 1));
  EXPECT_THAT(Why(3 * kHour + 1), HasSubstr("before this computer's clock was set back by"));
}

TEST_F(PermitBookTest, IgnoresWhatIsMalformedForeignOrOvertaken) {
  Accept(Body("axis1", 1, 501));
  Accept(Body("axis1", 1, 0));
  Accept(Body("axis2", 1, 500));
  book_.Accept("axis9", Enveloped(Body("axis9", 1, 500)), 0, kUtime);
  book_.Accept("axis1", {}, 0, kUtime);
  EXPECT_FALSE(Holds());

  Accept(Body("axis1", 5, 100));
  Accept(Body("axis1", 5, 500), 90 * kMillisecond);  // repeated
  EXPECT_FALSE(Holds(100 * kMillisecond));
  Accept(Body("axis1", 6, 100), 90 * kMillisecond);
  EXPECT_TRUE(Holds(100 * kMillisecond));
}

TEST_F(PermitBookTest, CountsOnlyNearTheTimeOfItsIssue) {
  permit_body_t body = Body("axis1", 1, 500);
  for (const std::int64_t age_us : {INT64_C(-1'000'001), INT64_C(1'500'001), INT64_C(3'600'000'000)}) {
    body.issued_utime = kUtime - age_us;
    Accept(body);
    EXPECT_FALSE(Holds()) << age_us;
  }
  for (const std::int64_t age_us : {-1'000'000, 0, 1'500'000}) {
    ++body.issue;
    body.issued_utime = kUtime - age_us;
    PermitTable fresh(bus_, UnsignedBridge());
    fresh.Accept("axis1", Enveloped(body), 0, kUtime);
    EXPECT_TRUE(fresh.Check("axis1", "bump", 1).has_value()) << age_us;
  }
  for (const std::int64_t utime : {INT64_MIN, INT64_MAX}) {
    body.issued_utime = utime;
    Accept(body);
    EXPECT_FALSE(Holds());
  }
}

TEST_F(PermitBookTest, AnotherIssuerCountsOnlyWhenItIsLater) {
  permit_body_t old = Body("axis1", 1'000, 500);
  Accept(old);
  permit_body_t of_new = Body("axis1", 1, 100);
  of_new.issuer_boot_id = 4;
  of_new.issued_utime = kUtime + 100'000;
  Accept(of_new, 100 * kMillisecond);
  EXPECT_TRUE(Holds(199 * kMillisecond));
  old.issue = 1'001;  // a recording of the control process that is gone
  Accept(old, 150 * kMillisecond);
  EXPECT_FALSE(Holds(200 * kMillisecond));
  EXPECT_THAT(Why(), HasSubstr("was issued 0.1 s before the last one of another control process"));
}

TEST_F(PermitBookTest, NotRequiredIsAlwaysHeld) {
  bus_.devices[0].permit_required = false;
  const PermitTable book(bus_, {});
  EXPECT_TRUE(book.Check("axis1", "bump", 0).has_value());
}

TEST_F(PermitBookTest, SaysWhyThereIsNone) {
  EXPECT_THAT(Why(), HasSubstr("no PERMIT/axis1 came"));
  permit_body_t body = Body("axis1", 1, 500);
  body.issued_utime = kUtime + 12'300'000;
  Accept(body);
  EXPECT_THAT(Why(), HasSubstr("was issued 12.3 s from now"));
  EXPECT_THAT(Why(), HasSubstr("1 s ago"));
  Accept(Body("axis1", 1, 500));
  EXPECT_THAT(book_.Check("axis1", "write", 1).error().text, HasSubstr("does not allow write"));
  EXPECT_THAT(Why(2 * kSecond), HasSubstr("the last PERMIT/axis1 ended 1.5 s ago"));
}

constexpr std::int64_t kClock = 77;  // of the driver's host
constexpr std::int64_t kBaseId = 5;
constexpr MonoNs kBaseAhead = 4'000 * kSecond;  // of the driver's CLOCK_MONOTONIC

// The driver's host has a claim of +- 2 ms on the base, or none.
class FixedClaims final : public BaseClaims {
 public:
  [[nodiscard]] std::optional<BaseClaim> At(MonoNs mono) const override {
    if (id == 0) return std::nullopt;
    return BaseClaim{id, mono + kBaseAhead, half_width};
  }
  std::int64_t id = kBaseId;
  MonoNs half_width = 2 * kMillisecond;
};

class PermitAgeTest : public PermitBookTest {
 protected:
  static constexpr MonoNs kNow = 100 * kSecond;

  // Issued on the driver's host, `age` before kNow; UNIX time is wrong by an hour there.
  static permit_body_t OnSameHost(MonoNs age, std::int64_t issue = 1) {
    permit_body_t body = Body("axis1", issue, 500);
    body.issued_utime = kUtime + kNow / kMicrosecond + 3'600'000'000;
    body.clock_id = kClock;
    body.issued_mono_ns = kNow - age;
    return body;
  }
  // Issued on another host of the base.
  static permit_body_t OnOtherHost(MonoNs age, MonoNs half_width, std::int64_t issue = 1) {
    permit_body_t body = OnSameHost(age, issue);
    body.clock_id = kClock + 1;
    body.issued_mono_ns = 7;
    body.base_id = kBaseId;
    body.issued_base_ns = kNow + kBaseAhead - age;
    body.issued_half_width_ns = half_width;
    return body;
  }
  [[nodiscard]] bool Accepts(const permit_body_t& body) {
    timed_.Accept("axis1", Enveloped(body), kNow, kUtime + kNow / kMicrosecond);
    return timed_.Check("axis1", "bump", kNow).has_value();
  }
  [[nodiscard]] std::string Refusal(const permit_body_t& body) {
    timed_.Accept("axis1", Enveloped(body), kNow, kUtime + kNow / kMicrosecond);
    return ErrorText(timed_.Check("axis1", "bump", kNow + kSecond));
  }

  FixedClaims claims_;
  PermitTable timed_{bus_, UnsignedBridge(), kClock, &claims_};
};

TEST_F(PermitAgeTest, OnOneHostUnixTimeDoesNotCount) {
  EXPECT_TRUE(Accepts(OnSameHost(0)));
  permit_body_t skewed = OnSameHost(0, 2);
  skewed.issued_utime = kUtime + kNow / kMicrosecond - 3'000'000;
  EXPECT_TRUE(Accepts(skewed));
  EXPECT_TRUE(Accepts(OnSameHost(1'500 * kMillisecond, 3)));
}

TEST_F(PermitAgeTest, OnOneHostAnOldPermitIsRefusedByItsClock) {
  permit_body_t old = OnSameHost(1'500 * kMillisecond + 1);
  old.issued_utime = kUtime + kNow / kMicrosecond;
  EXPECT_FALSE(Accepts(old));
  EXPECT_THAT(Refusal(old), HasSubstr("was issued 1.5 s ago by CLOCK_MONOTONIC of this computer"));
  EXPECT_FALSE(Accepts(OnSameHost(-kSecond - 1)));
  EXPECT_FALSE(Accepts(OnSameHost(INT64_MIN / 2)));
}

TEST_F(PermitAgeTest, AStepOfUnixTimeOnTheHostRefusesNothing) {
  constexpr std::int64_t kHour = 3'600'000'000;
  permit_body_t body = OnSameHost(0, 1);
  timed_.Accept("axis1", Enveloped(body), kNow, kUtime + kHour);
  EXPECT_TRUE(timed_.Check("axis1", "bump", kNow));
  body = OnSameHost(-kSecond, 2);  // UNIX time was set back an hour for both
  body.issued_utime = kUtime;
  timed_.Accept("axis1", Enveloped(body), kNow + kSecond, kUtime);
  EXPECT_TRUE(timed_.Check("axis1", "bump", kNow + kSecond)) << Why(kNow + kSecond);
  body = OnSameHost(-2 * kSecond, 1);  // the control process was started again
  body.issuer_boot_id = 9;
  body.issued_utime = kUtime - kHour;
  timed_.Accept("axis1", Enveloped(body), kNow + 2 * kSecond, kUtime - kHour);
  EXPECT_TRUE(timed_.Check("axis1", "bump", kNow + 2 * kSecond));
}

TEST_F(PermitAgeTest, ARecordingOfAnEndedProcessOfTheHostIsRefused) {
  const permit_body_t recorded = OnSameHost(200 * kMillisecond, 50);
  permit_body_t present = OnSameHost(100 * kMillisecond, 1);
  present.issuer_boot_id = 4;
  EXPECT_TRUE(Accepts(present));
  EXPECT_THAT(Refusal(recorded),
              HasSubstr("was issued 0.1 s before the last one of another control process, by CLOCK_MONOTONIC"));
}

TEST_F(PermitAgeTest, OfAnotherHostTheTimeBaseCounts) {
  EXPECT_TRUE(Accepts(OnOtherHost(0, kMillisecond)));
  EXPECT_TRUE(Accepts(OnOtherHost(1'497 * kMillisecond, kMillisecond, 2))) << "with both half widths 1.5 s";
  EXPECT_TRUE(Accepts(OnOtherHost(-997 * kMillisecond, kMillisecond, 3)));
}

TEST_F(PermitAgeTest, OfAnotherHostTheAgeMustBeProven) {
  EXPECT_FALSE(Accepts(OnOtherHost(1'497 * kMillisecond + 1, kMillisecond)));
  EXPECT_FALSE(Accepts(OnOtherHost(-997 * kMillisecond - 1, kMillisecond)));
  EXPECT_FALSE(Accepts(OnOtherHost(0, 2 * kSecond)));
  EXPECT_THAT(Refusal(OnOtherHost(12'300 * kMillisecond, 3 * kMillisecond)),
              HasSubstr("was issued 12.3 s +- 0.005 s ago by the time base"));
  EXPECT_FALSE(Accepts(OnOtherHost(0, INT64_MAX)));
}

TEST_F(PermitAgeTest, AnotherProcessOfTheBaseMustBeProvenToBeLater) {
  EXPECT_TRUE(Accepts(OnOtherHost(100 * kMillisecond, kMillisecond)));
  permit_body_t next = OnOtherHost(98 * kMillisecond, kMillisecond);
  next.issuer_boot_id = 4;
  next.clock_id = kClock + 2;
  EXPECT_THAT(Refusal(next),
              HasSubstr("was issued 0.002 s +- 0.002 s after the last one of another control process"));
  next.issued_base_ns += 1;
  EXPECT_TRUE(Accepts(next));
}

TEST_F(PermitAgeTest, WithoutAClaimOfBothUnixTimeCounts) {
  permit_body_t other = OnOtherHost(0, kMillisecond);
  EXPECT_TRUE(Accepts(other));
  claims_.id = 0;
  other.issue = 2;
  EXPECT_THAT(Refusal(other), HasSubstr("was issued 3600 s from now by UNIX time"));
  claims_.id = kBaseId + 1;  // another base
  EXPECT_THAT(Refusal(other), HasSubstr("by UNIX time"));
  other.issued_utime = kUtime + kNow / kMicrosecond;
  other.issue = 3;
  EXPECT_TRUE(Accepts(other));
  claims_.id = kBaseId;
  other.issued_half_width_ns = -1;
  other.issue = 4;
  EXPECT_TRUE(Accepts(other)) << "no claim of the issuer";
}

class SignedPermitTest : public PermitBookTest {
 protected:
  SignedPermitTest() {
    bridge_.keys = {Grant("plc", plc_, Role::kControl), Grant("panel", panel_, Role::kMaintainer)};
  }
  static KeyGrant Grant(const std::string& name, const SigningKey& key, Role role) {
    KeyGrant grant;
    grant.name = name;
    grant.key = key.public_key();
    grant.id = KeyId(key.public_key());
    grant.role = role;
    return grant;
  }
  // The answer of the table to a permit for bump on axis1, signed with a key that is `claimed`.
  std::string Answer(const SigningKey& claimed, const SigningKey& signer) {
    PermitTable book(bus_, bridge_);
    permit_body_t body = Body("axis1", 1, 500);
    body.key_id = KeyId(claimed.public_key());
    book.Accept("axis1", Enveloped(body, &signer), 0, kUtime);
    return book.Check("axis1", "bump", 1).has_value() ? "" : book.Check("axis1", "bump", 1).error().text;
  }

  SigningKey plc_ = SigningKey::Generate();
  SigningKey panel_ = SigningKey::Generate();
  SigningKey stranger_ = SigningKey::Generate();
  BridgeConfig bridge_;
};

TEST_F(SignedPermitTest, CountsWhenAControlProcessSignedIt) {
  EXPECT_EQ(Answer(plc_, plc_), "");
  EXPECT_THAT(Answer(plc_, stranger_), HasSubstr("wrong signature: it is not of the key plc"));
  EXPECT_THAT(Answer(stranger_, stranger_), HasSubstr("does not name"));
  EXPECT_THAT(Answer(panel_, panel_), HasSubstr("panel, whose role is not control"));
}

TEST_F(SignedPermitTest, ReachesAsFarAsItsGrant) {
  bridge_.keys[0].devices = {"axis2"};
  EXPECT_THAT(Answer(plc_, plc_), HasSubstr("key is not valid for this device"));
  bridge_.keys[0].devices = {"axis2", "axis1"};
  bridge_.keys[0].operations = {"write"};
  EXPECT_THAT(Answer(plc_, plc_), HasSubstr("its key may not permit it"));
  bridge_.keys[0].operations = {"write", "bump"};
  EXPECT_EQ(Answer(plc_, plc_), "");
}

TEST_F(SignedPermitTest, UnsignedOnlyWhereThatIsAllowed) {
  PermitTable refusing(bus_, bridge_);
  refusing.Accept("axis1", Enveloped(Body("axis1", 1, 500)), 0, kUtime);
  EXPECT_FALSE(refusing.Check("axis1", "bump", 1).has_value());
  EXPECT_THAT(refusing.Check("axis1", "bump", 1).error().text, HasSubstr("was unsigned"));
  bridge_.allow_unsigned = true;
  PermitTable allowing(bus_, bridge_);
  allowing.Accept("axis1", Enveloped(Body("axis1", 1, 500)), 0, kUtime);
  EXPECT_TRUE(allowing.Check("axis1", "bump", 1).has_value());
}

TEST_F(SignedPermitTest, AChangedByteIsNoPermit) {
  permit_body_t body = Body("axis1", 1, 500);
  body.key_id = KeyId(plc_.public_key());
  const std::vector<std::uint8_t> good = Enveloped(body, &plc_);
  // Beyond the envelope's head, which is not signed: the permit and its signature.
  for (std::size_t i = 8 + 48 + 2; i < good.size() - 16; ++i) {
    std::vector<std::uint8_t> bytes = good;
    bytes[i] ^= 0x10;
    PermitTable book(bus_, bridge_);
    book.Accept("axis1", bytes, 0, kUtime);
    EXPECT_FALSE(book.Check("axis1", "bump", 1).has_value()) << i;
  }
  PermitTable book(bus_, bridge_);
  book.Accept("axis1", good, 0, kUtime);
  EXPECT_TRUE(book.Check("axis1", "bump", 1).has_value());
}

// ---- permits at their limits ----

TEST_F(PermitBookTest, AMillisecondIsTheShortestTimeOfAPermit) {
  Accept(Body("axis1", 1, 1));
  EXPECT_TRUE(Holds(kMillisecond - 1));
  EXPECT_FALSE(Holds(kMillisecond));
}

TEST_F(PermitBookTest, APermitNamesUpTo24Operations) {
  permit_body_t body = Body("axis1", 1, 500);
  body.operations.assign(24, "bump");
  body.n_operations = 24;
  Accept(body);
  EXPECT_TRUE(Holds());
  body.issue = 2;
  body.operations.push_back("write");
  body.n_operations = 25;
  Accept(body);
  EXPECT_FALSE(book_.Check("axis1", "write", 1).has_value());
}

TEST_F(PermitBookTest, ADeviceOfAnotherBusHasNoPermit) {
  EXPECT_EQ(book_.Check("axis9", "bump", 0).error().text, "there is no such device");
  EXPECT_EQ(book_.Check("axis9", "bump", 0).error().reason, command_status_t::REASON_NO_PERMIT);
}

TEST_F(PermitBookTest, ALaterPermitReplacesTheOperations) {
  Accept(Body("axis1", 1, 500));
  permit_body_t body = Body("axis1", 2, 500);
  body.operations = {"write"};
  Accept(body);
  EXPECT_FALSE(Holds());
  EXPECT_TRUE(book_.Check("axis1", "write", 1).has_value());
}

TEST_F(PermitBookTest, AnAcceptedPermitEndsTheReasonOfARefusedOne) {
  permit_body_t old = Body("axis1", 1, 500);
  old.issued_utime = kUtime - 3'600'000'000;
  Accept(old);
  EXPECT_THAT(Why(), HasSubstr("was issued 3600 s ago by UNIX time"));
  Accept(Body("axis1", 2, 100));
  EXPECT_THAT(Why(), HasSubstr("ended 0.9 s ago"));
}

TEST_F(PermitBookTest, ARepetitionIsNamedSo) {
  Accept(Body("axis1", 5, 100));
  Accept(Body("axis1", 5, 100));
  EXPECT_THAT(Why(), HasSubstr("was a repetition: issue must increase"));
}

TEST_F(PermitBookTest, AnotherProcessWithinTheSameMicrosecondIsNotLater) {
  Accept(Body("axis1", 1, 100));
  permit_body_t other = Body("axis1", 1, 500);
  other.issuer_boot_id = 4;
  Accept(other);
  EXPECT_THAT(Why(), HasSubstr("was issued 0 s before the last one of another control process, by UNIX time"));
  other.issued_utime = kUtime + 1;
  Accept(other);
  EXPECT_TRUE(Holds(400 * kMillisecond));
}

// The clock may be set back by up to a second, as permits may be early by that.
TEST_F(PermitBookTest, AClockThatIsSetBackByASecondRefusesNothing) {
  permit_body_t body = Body("axis1", 1, 500);
  body.issued_utime = kUtime + 10'000'000;
  Accept(body, 10 * kSecond);
  EXPECT_TRUE(Holds(10 * kSecond + 1));
  const auto after_set_back = [&](std::int64_t by_us, std::int64_t issue) {
    permit_body_t later = Body("axis1", issue, 500);
    const std::int64_t unix_us = kUtime + 20'000'000 - by_us;
    later.issued_utime = unix_us - 1'500'000;
    book_.Accept("axis1", Enveloped(later), 20 * kSecond, unix_us);
    return Holds(20 * kSecond + 1);
  };
  EXPECT_FALSE(after_set_back(1'000'001, 2));
  EXPECT_THAT(Why(20 * kSecond), HasSubstr("set back by 1 s"));
  EXPECT_TRUE(after_set_back(1'000'000, 3));
}

TEST_F(PermitAgeTest, APermitOfThisHostIsAcceptedAfterTheClockWasSetBack) {
  EXPECT_TRUE(Accepts(OnSameHost(0, 1)));
  permit_body_t body = OnSameHost(0, 2);
  body.issued_utime = kUtime - 3'600'000'000;
  timed_.Accept("axis1", Enveloped(body), kNow, kUtime - 3'600'000'000);
  EXPECT_TRUE(timed_.Check("axis1", "bump", kNow + 499 * kMillisecond));
}

TEST_F(PermitAgeTest, ClocksThatAreNotStatedAreNotEqual) {
  PermitTable nameless(bus_, UnsignedBridge(), 0, &claims_);
  permit_body_t body = OnSameHost(0);
  body.clock_id = 0;
  body.issued_utime = kUtime + kNow / kMicrosecond - 3'000'000;
  nameless.Accept("axis1", Enveloped(body), kNow, kUtime + kNow / kMicrosecond);
  EXPECT_THAT(ErrorText(nameless.Check("axis1", "bump", kNow)), HasSubstr("was issued 3 s ago by UNIX time"));
}

TEST_F(PermitBookTest, AnAgeOfAThousandSecondsIsStatedInWholeSeconds) {
  permit_body_t body = Body("axis1", 1, 500);
  body.issued_utime = kUtime - 1'000'000'000;
  Accept(body);
  EXPECT_THAT(Why(), HasSubstr("was issued 1000 s ago"));
}

TEST_F(PermitBookTest, ARefusalStatesHowLongAgoItWas) {
  Accept(Body("axis1", 1, 500), 10 * kSecond);
  EXPECT_THAT(Why(13 * kSecond), HasSubstr("the last PERMIT/axis1, 3 s ago, was issued 10 s ago"));
}

TEST_F(PermitBookTest, APermitHasEndedAtTheEndOfItsTime) {
  Accept(Body("axis1", 1, 500));
  EXPECT_THAT(Why(500 * kMillisecond), HasSubstr("the last PERMIT/axis1 ended 0 s ago"));
}

TEST_F(PermitBookTest, APermitThatIsYoungByTheLatestTimeIsAcceptedAfterASetBack) {
  Accept(Body("axis1", 1, 500));
  const auto accepts = [&](MonoNs now, std::int64_t issue, std::int64_t age_us) {
    const std::int64_t latest = kUtime + now / kMicrosecond;
    permit_body_t body = Body("axis1", issue, 500);
    body.issued_utime = latest - age_us;
    book_.Accept("axis1", Enveloped(body), now, latest - 1'200'000);
    return Holds(now + 1);
  };
  EXPECT_TRUE(accepts(10 * kSecond, 2, 1'500'000)) << "its time and the tolerance";
  EXPECT_FALSE(accepts(20 * kSecond, 3, 1'500'001));
}

TEST_F(PermitAgeTest, AClaimMayHaveAnyBaseAndNoHalfWidth) {
  claims_.id = 1;
  claims_.half_width = 0;
  permit_body_t body = OnOtherHost(0, 0);
  body.base_id = 1;
  EXPECT_TRUE(Accepts(body)) << "by UNIX time, it would be an hour from now";
}

TEST_F(PermitAgeTest, AnAgeThatIsNotProvenIsStatedWithItsDirection) {
  EXPECT_THAT(Refusal(OnOtherHost(0, 2 * kSecond)), HasSubstr("was issued 0 s +- 2 s from now by the time base"));
  EXPECT_THAT(Refusal(OnOtherHost(1, 2 * kSecond)), HasSubstr("was issued 1e-09 s +- 2 s ago by the time base"));
}

TEST_F(PermitAgeTest, AnotherProcessIsLaterByANanosecond) {
  permit_body_t first = OnSameHost(kMillisecond);
  first.valid_ms = 1;
  EXPECT_TRUE(Accepts(first));
  permit_body_t next = OnSameHost(kMillisecond - 1);
  next.issuer_boot_id = 4;
  EXPECT_TRUE(Accepts(next));
  EXPECT_TRUE(timed_.Check("axis1", "bump", kNow + 2 * kMillisecond)) << "the time of the first is over";
}

TEST_F(PermitAgeTest, AnotherProcessThatIsNotProvenToBeLaterIsStatedAsLater) {
  EXPECT_TRUE(Accepts(OnOtherHost(100 * kMillisecond, kMillisecond)));
  permit_body_t next = OnOtherHost(100 * kMillisecond - 1, kMillisecond);
  next.issuer_boot_id = 4;
  next.clock_id = kClock + 2;
  EXPECT_THAT(Refusal(next), HasSubstr("was issued 1e-09 s +- 0.002 s after the last one"));
}

TEST(CommandAuthorityRule, StatesWhichCommandsAreExecuted) {
  BridgeConfig bridge;
  EXPECT_THAT(std::string(CommandAuthority(bridge).Rule()), HasSubstr("no command is executed"));
  bridge.allow_unsigned = true;
  EXPECT_THAT(std::string(CommandAuthority(bridge).Rule()), HasSubstr("of any sender are executed"));
  bridge.bridge.public_key = SigningKey::Generate().public_key();
  EXPECT_THAT(std::string(CommandAuthority(bridge).Rule()), HasSubstr("only commands that are signed"));
}

}  // namespace
}  // namespace axlecast
