#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>
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
  EXPECT_EQ(ends.Wait(2).back(), (Ends::List::value_type{cancelled, CommandOutcome::kCancelled}));
}

TEST(CommandClient, CallsBackWithoutAPort) {
  ClientSettings settings;
  settings.command_url = "udpm://nowhere";
  CommandClient client(settings);
  Ends ends(client);
  const CommandId first = client.Send(Zero());
  const CommandId second = client.Send(Zero());
  EXPECT_THAT(ends.Wait(2), testing::UnorderedElementsAre(testing::Pair(first, CommandOutcome::kNotAccepted),
                                                          testing::Pair(second, CommandOutcome::kNotAccepted)));
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

// The thread sanitizer checks the accesses.
TEST(PermitIssuer, ThreadsAllowAndWithdrawTogether) {
  PermitIssuer issuer(Nowhere());
  const auto work = [&issuer](const std::string& device) {
    for (int i = 1; i <= 200; ++i) {
      const std::vector<std::string> operations(static_cast<std::size_t>(i % 3 + 1), "zero");
      EXPECT_TRUE(issuer.Allow(device, operations, 1 + i % 500));
      if (i % 20 == 0) {
        EXPECT_TRUE(issuer.Withdraw(device));
      }
    }
  };
  std::vector<std::thread> threads;
  for (const char* device : {"axis1", "axis1", "axis2", "axis3"}) threads.emplace_back(work, device);
  for (std::thread& thread : threads) thread.join();
  EXPECT_GE(issuer.totals().sent, 20) << "withdrawals of axis2 and axis3 at least";
  EXPECT_EQ(issuer.totals().failed, 0);
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

}  // namespace
}  // namespace axlecast
