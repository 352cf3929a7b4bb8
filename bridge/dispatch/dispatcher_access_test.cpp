#include "bridge/dispatch/dispatcher_fixture.h"

namespace axlecast {
namespace {

const SigningKey& Key(const char* seed) {
  static std::map<std::string, SigningKey> keys;
  return keys.try_emplace(seed, SigningKey::Generate()).first->second;
}

KeyGrant Grant(const char* name, Role role) {
  KeyGrant grant;
  grant.name = name;
  grant.key = Key(name).public_key();
  grant.id = KeyId(grant.key);
  grant.role = role;
  return grant;
}

MachineConfig SignedMachine() {
  MachineConfig machine = TestMachine(false);
  machine.bridge.bridge.public_key = Key("bridge").public_key();
  machine.bridge.drivers.public_key = Key("drivers").public_key();
  machine.bridge.keys = {Grant("watcher", Role::kObserver), Grant("fitter", Role::kMaintainer),
                         Grant("worker", Role::kOperator)};
  return machine;
}

// A machine with keys. The driver's statuses are signed where the test requests it.
class DispatcherAccessTest : public DispatcherTest {
 protected:
  DispatcherAccessTest() : DispatcherTest(SignedMachine(), SigningKey::Parse(Key("bridge").FileText())) {
    SignedHello();
    sink_.Clear();
  }
  void SignedHello() {
    driver_status_t hello{};
    hello.devices = {OnlineDevice("axis1"), OnlineDevice("axis2")};
    hello.n_devices = 2;
    Signed(hello);
  }
  void Signed(driver_status_t status) {
    status.bus = "b0";
    status.boot_id = kDriver;
    status.seq = driver_seq_++;
    SignMessage(Key("drivers"), Domain::kDriver, status);
    bridge_->OnDriverStatus("DRIVER_STATUS/b0", Encoded(status), now_);
  }
  void SignedOutcome(const driver_order_t& order, std::int8_t state) {
    driver_status_t status{};
    status.kind = driver_status_t::KIND_STATUS;
    std::copy(std::begin(order.id), std::end(order.id), std::begin(status.id));
    status.device = order.device;
    status.operation = order.operation;
    status.epoch_after = -1;
    status.state = state;
    Signed(status);
  }
};

TEST_F(DispatcherAccessTest, ASignedCommandIsDoneAndAllThatTheBridgeSaysIsSigned) {
  EXPECT_EQ(SendSigned(Body(1), Key("fitter")).state, S::STATE_ROUTED);
  EXPECT_EQ(Last().is_unsigned, 0);
  for (const S& status : sink_.All<S>("COMMAND_STATUS")) {
    EXPECT_TRUE(VerifyMessage(Key("bridge").public_key(), Domain::kStatus, status));
  }
  const auto envelopes = sink_.All<driver_command_t>("DRIVER_COMMAND/b0");
  ASSERT_EQ(envelopes.size(), 1u);
  EXPECT_TRUE(Verify(Key("bridge").public_key(), Domain::kOrder, envelopes[0].order, SignatureOf(envelopes[0])));
  SignedOutcome(Orders()[0], S::STATE_SUCCEEDED);
  EXPECT_EQ(Last().state, S::STATE_SUCCEEDED);
}

TEST_F(DispatcherAccessTest, EachRoleDoesWhatItMayAndNoMore) {
  EXPECT_EQ(SendSigned(Body(1), Key("watcher")).reason_code, S::REASON_DENIED);
  ASSERT_FALSE(logged_.empty());
  EXPECT_EQ(logged_.back().substr(0, 9), "watcher: ");
  EXPECT_EQ(SendSigned(Body(2, "look"), Key("watcher")).state, S::STATE_ROUTED);
  SignedOutcome(Orders().back(), S::STATE_SUCCEEDED);
  EXPECT_EQ(SendSigned(Body(3), Key("worker")).reason_code, S::REASON_DENIED) << "bump is destructive";
  EXPECT_EQ(SendSigned(Body(4), Key("fitter")).state, S::STATE_ROUTED);
  EXPECT_FALSE(store_.Find(NumberedId(1)));
}

TEST_F(DispatcherAccessTest, ForeignCommandsAreCountedTellAnAlarmAndFloodNothing) {
  for (std::uint32_t i = 0; i < 1'000; ++i) SendSigned(Body(i), Key("stranger"));
  EXPECT_EQ(bridge_->unauthorized(), 1'001);  // with the first HELLO, which was not signed
  EXPECT_LE(Statuses(), static_cast<std::size_t>(UnauthorizedMessageCounter::kAnswersPerSecond));
  EXPECT_TRUE(Orders().empty());
  EXPECT_LE(store_.events.size(), 2u);
  Pass(kSecond);
  const auto alarms = data_.All<alarm_t>("ALARM/bridge");
  ASSERT_FALSE(alarms.empty());
  ASSERT_GE(alarms.back().n, 1);
  EXPECT_EQ(alarms.back().entries[0].name, "foreign_commands");
}

TEST_F(DispatcherAccessTest, AnotherMachineIsAnAlarmWithBothNames) {
  const auto alarm = [this] {
    data_.Clear();
    Pass(kSecond);
    const auto messages = data_.All<alarm_t>("ALARM/bridge");
    return messages.empty() || messages.back().n == 0 ? alarm_entry_t{} : messages.back().entries[0];
  };
  EXPECT_NE(alarm().name, "other_machine");
  other_machines_ = {{.id = NameHash("press2")}};
  EXPECT_EQ(alarm().name, "other_machine");
  other_machines_[0].name = "press2";
  EXPECT_EQ(alarm().action, machine_.machine + " and machine 'press2' use one LCM group: axlecast doctor");
  other_machines_.clear();
  EXPECT_NE(alarm().name, "other_machine");
}

TEST_F(DispatcherAccessTest, ADriverIsBelievedOnlyWithItsSignature) {
  SendSigned(Body(1), Key("fitter"));
  Report(Orders()[0], S::STATE_SUCCEEDED);  // forged
  EXPECT_EQ(Last().state, S::STATE_ROUTED);
  Hello(kDriver + 1);  // forged: it would end the command as INDETERMINATE
  EXPECT_EQ(Last().state, S::STATE_ROUTED);
  SignedOutcome(Orders()[0], S::STATE_SUCCEEDED);
  EXPECT_EQ(Last().state, S::STATE_SUCCEEDED);
}

TEST_F(DispatcherAccessTest, AForgedStatusFencesNobody) {
  S foreign{};
  foreign.boot_id = kBoot + 1;
  bridge_->OnCommandStatus(Encoded(foreign), now_);
  EXPECT_EQ(SendSigned(Body(1), Key("fitter")).state, S::STATE_ROUTED);
  SignMessage(Key("bridge"), Domain::kStatus, foreign);
  bridge_->OnCommandStatus(Encoded(foreign), now_);
  EXPECT_EQ(SendSigned(Body(2), Key("fitter")).reason_code, S::REASON_FENCED);
}

TEST_F(DispatcherAccessTest, OnlyWhoGaveItOrAMaintainerCancels) {
  SendSigned(Body(1), Key("fitter"));
  auto cancel = Body(1);
  cancel.mode = command_body_t::MODE_CANCEL;
  EXPECT_NE(SendSigned(cancel, Key("worker")).text.find("may cancel it"), std::string::npos);
  EXPECT_EQ(Orders().back().kind, driver_order_t::KIND_EXECUTE);
  SendSigned(cancel, Key("fitter"));
  EXPECT_EQ(Orders().back().kind, driver_order_t::KIND_CANCEL);
}

TEST_F(DispatcherAccessTest, ATokenIsCommittedByWhoPreparedIt) {
  auto body = Body(1, "look");
  body.mode = command_body_t::MODE_PREPARE;
  SendSigned(body, Key("watcher"));
  SignedOutcome(Orders().back(), S::STATE_SUCCEEDED);
  const S shown = Last();
  auto commit = Body(2, "look");
  commit.mode = command_body_t::MODE_COMMIT;
  std::copy(std::begin(shown.token), std::end(shown.token), std::begin(commit.token));
  EXPECT_EQ(SendSigned(commit, Key("fitter")).reason_code, S::REASON_TOKEN);
}

}  // namespace
}  // namespace axlecast
