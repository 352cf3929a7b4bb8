#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <atomic>
#include <condition_variable>
#include <fstream>
#include <mutex>
#include <thread>
#include <utility>

#include "client/axlecast/command_client.h"
#include "client/axlecast/permit_issuer.h"
#include "client/axlecast/position_tracker.h"
#include "client/command/signed_messages.h"
#include "core/messages/message.h"
#include "core/messages/origin.h"
#include "platform/os/process.h"
#include "tests/support/temporary_folder.h"

namespace axlecast {
namespace {

using testing::HasSubstr;

// Within this process, where no bridge is.
ClientSettings Nowhere() {
  ClientSettings settings;
  settings.command_url = "memq://";
  return settings;
}

CommandRequest Zero() { return {.device = "axis1", .operation = "zero"}; }

// position_tracker.h needs no library, so that it calculates both ids by itself.
TEST(Ids, OfTheTrackerAreThoseOfThePublishers) {
  EXPECT_EQ(IdOfName("press1"), NameHash("press1"));
  EXPECT_EQ(OwnClockId(), NewOrigin("press1").clock_id);
  EXPECT_EQ(NewOrigin("press1").machine_id, NameHash("press1"));
  EXPECT_EQ(NewOrigin("").machine_id, 0);
}

TEST(CommandClient, ATimeOutMeansUnknown) {
  CommandClient client(Nowhere());
  ASSERT_EQ(ErrorText(client.state()), "");
  const CommandResult result = client.Await(client.Send(Zero()), 1);
  EXPECT_EQ(result.outcome(), CommandOutcome::kUnknown);
  EXPECT_FALSE(result.temporary());
  EXPECT_TRUE(result.under_way);
  EXPECT_THAT(result.problem, HasSubstr("ask for this id later"));
}

TEST(CommandClient, CancelledBeforeABridgeWasHeard) {
  CommandClient client(Nowhere());
  const CommandId id = client.Send(Zero());
  client.Cancel(id);
  EXPECT_EQ(client.Await(id, 60'000).outcome(), CommandOutcome::kCancelled);
  EXPECT_EQ(client.Await(id, 0).outcome(), CommandOutcome::kCancelled);  // it is kept
}

TEST(CommandClient, ThreadsSendAndAwaitTogether) {
  CommandClient client(Nowhere());
  std::atomic<int> cancelled = 0;
  const auto work = [&client, &cancelled] {
    for (int i = 0; i < 50; ++i) {
      const CommandId id = client.Send(Zero());
      client.Cancel(id);
      if (client.Await(id, 60'000).outcome() == CommandOutcome::kCancelled) ++cancelled;
    }
  };
  std::thread one(work);
  std::thread other(work);
  one.join();
  other.join();
  EXPECT_EQ(cancelled, 100);
}

TEST(CommandClient, IsMovedWithWhatIsUnderWay) {
  CommandClient first(Nowhere());
  const CommandId id = first.Send(Zero());
  CommandClient second(std::move(first));
  second.Cancel(id);
  EXPECT_EQ(second.Await(id, 60'000).outcome(), CommandOutcome::kCancelled);
  second = CommandClient(Nowhere());
  EXPECT_THAT(second.Await(id, 0).problem, HasSubstr("does not know the id"));
}

TEST(CommandClient, WithoutAPortNothingIsSent) {
  ClientSettings settings;
  settings.command_url = "udpm://nowhere";
  CommandClient client(settings);
  EXPECT_FALSE(client.state());
  const CommandResult result = client.Await(client.Send(Zero()), 0);
  EXPECT_EQ(result.outcome(), CommandOutcome::kNotAccepted);
  EXPECT_NE(client.Query({1}, 0).problem, "");
}

// Counts the ends that the callback of a client receives.
class Ends {
 public:
  explicit Ends(CommandClient& client) {
    client.OnStatus([this](const CommandResult& result) {
      const std::lock_guard lock(mutex_);
      if (!result.under_way) ends_.emplace_back(result.id, result.outcome());
      changed_.notify_all();
    });
  }
  using List = std::vector<std::pair<CommandId, CommandOutcome>>;
  [[nodiscard]] List Wait(std::size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return ends_.size() >= count; });
    return ends_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  List ends_;
};

TEST(CommandClient, CallsBackForAnEndThatNoBridgeSent) {
  CommandClient client(Nowhere());
  Ends ends(client);
  const CommandId refused = client.Send({.device = "axis1", .operation = "zero", .valid_ms = 0});
  EXPECT_EQ(ends.Wait(1), (Ends::List{{refused, CommandOutcome::kNotAccepted}}));
  const CommandId cancelled = client.Send(Zero());
  client.Cancel(cancelled);
  EXPECT_THAT(ends.Wait(2),
              testing::UnorderedElementsAre(Ends::List::value_type{first, CommandOutcome::kNotAccepted},
                                            Ends::List::value_type{second, CommandOutcome::kNotAccepted}));
}

TEST(CommandClient, AKeyThatCannotBeUsedIsAProblem) {
  ClientSettings settings = Nowhere();
  settings.bridge_key = "12";
  EXPECT_THAT(ErrorText(CommandClient(settings).state()), HasSubstr("64 hex digits"));
  settings = Nowhere();
  settings.key_file = "/nowhere/key";
  EXPECT_THAT(ErrorText(CommandClient(settings).state()), HasSubstr("/nowhere/key"));
  EXPECT_THAT(ErrorText(PermitIssuer(settings).state()), HasSubstr("/nowhere/key"));
  EXPECT_FALSE(PermitIssuer(settings).Allow("axis1", {"zero"}, 500));
}

TEST(PermitIssuer, SendsOnlyWhatADriverAccepts) {
  PermitIssuer issuer(Nowhere());
  ASSERT_EQ(ErrorText(issuer.state()), "");
  EXPECT_TRUE(issuer.Allow("axis1", {"zero"}, 1));
  EXPECT_TRUE(issuer.Allow("axis1", {"zero"}, 500));
  EXPECT_TRUE(issuer.Withdraw("axis1"));
  EXPECT_FALSE(issuer.Allow("axis1", {"zero"}, 0));
  EXPECT_FALSE(issuer.Allow("axis1", {"zero"}, 501));
  EXPECT_FALSE(issuer.Allow("axis1", std::vector<std::string>(25, "zero"), 500));
  EXPECT_FALSE(issuer.Allow("axis1", std::vector<std::string>(24, std::string(60, 'x')), 500));  // > 1200 bytes
  EXPECT_FALSE(issuer.Allow("", {"zero"}, 500));
  EXPECT_FALSE(issuer.Allow("axis1", {""}, 500));
}

TEST(PermitMessage, IsSignedOverItsBody) {
  const SigningKey key = SigningKey::Generate();
  permit_body_t body{};
  body.device = "axis1";
  body.valid_ms = 200;
  body.operations = {"zero", "reset"};
  const permit_t permit = MakePermit(body, &key);
  EXPECT_TRUE(Verify(key.public_key(), Domain::kPermit, permit.permit, SignatureOf(permit)));
  const auto decoded = DecodeMessage<permit_body_t>(permit.permit);
  ASSERT_TRUE(decoded);
  EXPECT_EQ(decoded->n_operations, 2);
  EXPECT_EQ(decoded->key_id, KeyId(key.public_key()));
  EXPECT_EQ(MakePermit(body, nullptr).sig[0], 0);
}

class OfMachine : public testing::Test {
 protected:
  void Write(const std::string& name, const std::string& text) const {
    std::ofstream(Path(name)) << text;
    ASSERT_EQ(chmod(Path(name).c_str(), 0600), 0);
  }
  [[nodiscard]] std::string Path(const std::string& name) const { return folder_.path() + "/" + name; }
  void WriteMachine() {
    Write("plc.key", plc_.FileText());
    Write("machine.yaml",
          "machine: m\nlcm: {command_url: 'udpm://239.255.76.67:7777?ttl=0', prefix: p_}\n"
          "bridge:\n  key: {public: " +
              KeyText(bridge_.public_key()) +
              ", file: /nowhere/b}\n"
              "  keys:\n    far: {public: " +
              KeyText(far_.public_key()) +
              ", role: maintainer}\n"
              "    plc: {public: " +
              KeyText(plc_.public_key()) + ", role: control, file: " + Path("plc.key") +
              "}\n"
              "buses:\n  b:\n    family: tformat\n    link: {port: /dev/null, baud: 2500000}\n"
              "    devices:\n      axis1: {model: ts5669n127}\n");
  }

  const TemporaryFolder folder_;
  const SigningKey bridge_ = SigningKey::Generate();
  const SigningKey plc_ = SigningKey::Generate();
  const SigningKey far_ = SigningKey::Generate();
};

TEST_F(OfMachine, ReadsUrlPrefixAndKeys) {
  WriteMachine();
  const auto settings = ClientSettings::OfMachine(Path("machine.yaml"), "");
  ASSERT_TRUE(settings) << settings.error().text;
  EXPECT_EQ(settings->command_url, "udpm://239.255.76.67:7777?ttl=0");
  EXPECT_EQ(settings->prefix, "p_");
  EXPECT_EQ(settings->bridge_key, KeyText(bridge_.public_key()));
  EXPECT_EQ(settings->key_file, Path("plc.key"));
}

TEST_F(OfMachine, SaysWhatIsWrong) {
  WriteMachine();
  EXPECT_THAT(ErrorText(ClientSettings::OfMachine(Path("machine.yaml"), "far")), HasSubstr("far"));
  EXPECT_THAT(ErrorText(ClientSettings::OfMachine(Path("machine.yaml"), "nobody")),
              HasSubstr("there are far, plc"));
  EXPECT_THAT(ErrorText(ClientSettings::OfMachine(Path("none.yaml"), "")), HasSubstr("none.yaml"));
}

}  // namespace
}  // namespace axlecast
