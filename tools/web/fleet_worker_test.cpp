#include "tools/web/fleet_worker.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>

namespace axlecast {
namespace {

using ::testing::ElementsAre;

FleetRequest Question(std::int64_t id) { return {.id = id}; }

// A worker whose answers each wait until they are released.
class FleetWorkerTest : public ::testing::Test {
 protected:
  ~FleetWorkerTest() override { Release(1000); }

  std::string Answer(const FleetRequest& request) {
    std::unique_lock lock(mutex_);
    begun_.push_back(request.id);
    changed_.notify_all();
    changed_.wait(lock, [this] { return released_ > 0; });
    --released_;
    return std::to_string(request.id);
  }
  void Release(int answers) {
    const std::lock_guard lock(mutex_);
    released_ += answers;
    changed_.notify_all();
  }
  void WaitForBegun(std::size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return begun_.size() >= count; });
  }
  std::string TakeNext(WebConnection connection) {
    while (true) {
      if (auto frame = worker_->Take(connection)) return *frame;
      std::this_thread::yield();
    }
  }
  std::vector<std::int64_t> begun() {
    const std::lock_guard lock(mutex_);
    return begun_;
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  int released_ = 0;
  std::vector<std::int64_t> begun_;
  std::unique_ptr<FleetWorker> worker_ = std::make_unique<FleetWorker>(
      [this](const FleetRequest& request) { return Answer(request); }, [this] { Release(1000); });
};

TEST_F(FleetWorkerTest, AnswersGoToTheBrowserThatAsked) {
  ASSERT_TRUE(worker_->Ask(1, Question(10)));
  ASSERT_TRUE(worker_->Ask(2, Question(20)));
  Release(2);
  EXPECT_EQ(TakeNext(2), "20");
  EXPECT_EQ(TakeNext(1), "10");
  EXPECT_EQ(worker_->Take(1), std::nullopt);
  EXPECT_EQ(worker_->Take(3), std::nullopt);
}

TEST_F(FleetWorkerTest, AskingNeverWaitsForAnAnswer) {
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(worker_->Ask(1, Question(i)));
  WaitForBegun(1);
  EXPECT_EQ(worker_->Take(1), std::nullopt);
}

TEST_F(FleetWorkerTest, BrowsersTakeTurns) {
  ASSERT_TRUE(worker_->Ask(1, Question(11)));
  WaitForBegun(1);
  for (const int id : {12, 13}) ASSERT_TRUE(worker_->Ask(1, Question(id)));
  for (const int id : {21, 22}) ASSERT_TRUE(worker_->Ask(2, Question(id)));
  Release(5);
  WaitForBegun(5);
  EXPECT_THAT(begun(), ElementsAre(11, 21, 12, 22, 13));
}

TEST_F(FleetWorkerTest, OneBrowserHasFewOpenQuestionsUntilItTakesTheAnswers) {
  for (std::size_t i = 0; i < FleetWorker::kMaxOpen; ++i) EXPECT_TRUE(worker_->Ask(1, Question(1)));
  EXPECT_FALSE(worker_->Ask(1, Question(1)));
  EXPECT_TRUE(worker_->Ask(2, Question(1))) << "another browser";
  Release(static_cast<int>(FleetWorker::kMaxOpen) + 1);
  EXPECT_EQ(TakeNext(2), "1");
  EXPECT_FALSE(worker_->Ask(1, Question(1))) << "answers that were not taken count";
  EXPECT_EQ(TakeNext(1), "1");
  EXPECT_TRUE(worker_->Ask(1, Question(1)));
}

TEST_F(FleetWorkerTest, OfABrowserThatIsGoneNothingIsAskedAnyMore) {
  for (const int id : {1, 2, 3}) ASSERT_TRUE(worker_->Ask(1, Question(id)));
  WaitForBegun(1);
  worker_->Forget(1);
  ASSERT_TRUE(worker_->Ask(2, Question(4)));
  Release(9);
  EXPECT_EQ(TakeNext(2), "4");
  EXPECT_THAT(begun(), ElementsAre(1, 4));
  EXPECT_EQ(worker_->Take(1), std::nullopt);
}

TEST_F(FleetWorkerTest, EndsWhileAnAnswerIsAwaited) {
  ASSERT_TRUE(worker_->Ask(1, Question(1)));
  ASSERT_TRUE(worker_->Ask(1, Question(2)));
  WaitForBegun(1);
  worker_.reset();  // the second function makes the first one return
  EXPECT_THAT(begun(), ElementsAre(1));
}

}  // namespace
}  // namespace axlecast
