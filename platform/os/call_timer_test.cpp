#include "platform/os/call_timer.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <thread>

#include "platform/os/descriptor.h"
#include "platform/os/system_clock.h"

namespace axlecast {
namespace {

class CallTimerTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::array<int, 2> ends{};
    ASSERT_EQ(pipe2(ends.data(), O_CLOEXEC), 0);
    empty_ = Descriptor(ends[0]);
    writer_ = Descriptor(ends[1]);
  }

  // Reads from a pipe without bytes until `deadline`.
  void ReadUntil(MonoNs deadline) {
    char byte = 0;
    do {
      ASSERT_TRUE(timer_.Set(deadline, clock_));
      ASSERT_EQ(read(empty_.get(), &byte, 1), -1);
      ASSERT_EQ(errno, EINTR);
    } while (clock_.Now() < deadline);
    timer_.Clear();
  }

  SystemClock clock_;
  CallTimer& timer_ = CallTimer::OfThisThread();
  Descriptor empty_;
  Descriptor writer_;
};

TEST_F(CallTimerTest, EndsABlockingReadAtItsDeadline) {
  for (const MonoNs wait : {MonoNs{0}, MonoNs{1}, 20 * kMicrosecond, 2 * kMillisecond})
    ReadUntil(clock_.Now() + wait);
  ReadUntil(clock_.Now() - kSecond);
}

TEST_F(CallTimerTest, IsSetAgainForAnEarlierDeadlineOnly) {
  const MonoNs now = clock_.Now();
  ASSERT_TRUE(timer_.Set(now + 3600 * kSecond, clock_));
  EXPECT_TRUE(timer_.IsSet(now + 3600 * kSecond));
  EXPECT_TRUE(timer_.IsSet(kNever));
  EXPECT_FALSE(timer_.IsSet(now + kSecond));
  ReadUntil(clock_.Now() + kMillisecond);
}

TEST_F(CallTimerTest, AReadWithALaterDeadlineGoesOnAfterItWasEnded) {
  ASSERT_TRUE(timer_.Set(clock_.Now() + kMillisecond, clock_));
  const MonoNs deadline = clock_.Now() + 3 * kMillisecond;
  ReadUntil(deadline);
  EXPECT_GE(clock_.Now(), deadline);
}

TEST_F(CallTimerTest, StopsItselfWhereNoCallIsMeant) {
  const MonoNs expiry = clock_.Now() + kMillisecond;
  ASSERT_TRUE(timer_.Set(expiry, clock_));
  timer_.Clear();
  while (timer_.IsSet(kNever)) static_cast<void>(PollUntil({}, clock_.Now() + kMillisecond, clock_));
  EXPECT_GE(clock_.Now(), expiry);
  const timespec longer_than_its_period{.tv_sec = 0, .tv_nsec = 2'000'000};
  EXPECT_EQ(nanosleep(&longer_than_its_period, nullptr), 0) << "no further signal";
}

TEST_F(CallTimerTest, ASignalOfAnotherSenderHasNoEffect) {
  ASSERT_TRUE(timer_.Set(clock_.Now() + 3600 * kSecond, clock_));
  ASSERT_EQ(raise(SIGRTMIN), 0);
  EXPECT_TRUE(timer_.IsSet(kNever));
  timer_.Clear();
}

// A process of the same user can send a signal that looks like the timer's.
TEST_F(CallTimerTest, AForgedExpiryOnlyEndsACall) {
  ASSERT_TRUE(timer_.Set(clock_.Now() + 3600 * kSecond, clock_));
  siginfo_t forged{};
  forged.si_signo = SIGRTMIN;
  forged.si_code = SI_TIMER;
  forged.si_value.sival_ptr = &forged;
  ASSERT_EQ(syscall(SYS_rt_tgsigqueueinfo, getpid(), syscall(SYS_gettid), SIGRTMIN, &forged), 0);
  timer_.Clear();
  ReadUntil(clock_.Now() + kMillisecond);
}

TEST_F(CallTimerTest, EachThreadHasItsOwn) {
  ASSERT_TRUE(timer_.Set(clock_.Now() + 3600 * kSecond, clock_));
  std::thread other([this] {
    CallTimer& timer = CallTimer::OfThisThread();
    EXPECT_NE(&timer, &timer_);
    EXPECT_FALSE(timer.IsSet(kNever));
    char byte = 0;
    ASSERT_TRUE(timer.Set(clock_.Now() + kMillisecond, clock_));
    EXPECT_EQ(read(empty_.get(), &byte, 1), -1);
    timer.Clear();
  });
  other.join();
  EXPECT_TRUE(timer_.IsSet(kNever)) << "not interrupted";
  timer_.Clear();
}

}  // namespace
}  // namespace axlecast
