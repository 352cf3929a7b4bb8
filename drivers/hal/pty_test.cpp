#include "drivers/hal/pty.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <utility>
#include <vector>

#include "tests/support/temporary_folder.h"

namespace axlecast {
namespace {

class PtyTest : public testing::Test {
 protected:
  PtyTest() { path_ = directory_ + "/bus.pty"; }

  [[nodiscard]] Descriptor OpenHost() const { return Descriptor(open(path_.c_str(), O_RDWR | O_NOCTTY)); }

  static bool Readable(int fd) {
    pollfd wanted{fd, POLLIN, 0};
    return poll(&wanted, 1, 1000) == 1 && (wanted.revents & POLLIN) != 0;
  }

  const TemporaryFolder folder_;
  const std::string directory_ = folder_.path();
  std::string path_;
  Pty pty_;
};

// Every byte value passes unchanged and at once, although nobody but us has set the line up.
TEST_F(PtyTest, CarriesEveryByteBothWays) {
  ASSERT_EQ(ErrorText(pty_.Open(path_)), "");
  const Descriptor host = OpenHost();
  ASSERT_TRUE(host.valid());
  std::vector<std::uint8_t> all(256);
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::uint8_t>(i);

  ASSERT_EQ(write(host.get(), all.data(), all.size()), 256);
  std::vector<std::uint8_t> got(300);
  ASSERT_TRUE(Readable(pty_.FileDescriptor()));
  got.resize(pty_.Read(got));
  EXPECT_EQ(got, all);
  EXPECT_EQ(pty_.Read(got), 0U) << "nothing is echoed";

  ASSERT_TRUE(pty_.Write(all));
  got.resize(300);
  ASSERT_TRUE(Readable(host.get()));
  const ssize_t count = read(host.get(), got.data(), got.size());
  ASSERT_GT(count, 0);
  got.resize(static_cast<std::size_t>(count));
  EXPECT_EQ(got, all);
}

TEST_F(PtyTest, TellsWhetherAHostIsThere) {
  ASSERT_EQ(ErrorText(pty_.Open(path_)), "");
  EXPECT_FALSE(pty_.HasHost());
  {
    const Descriptor host = OpenHost();
    EXPECT_TRUE(pty_.HasHost());
  }
  EXPECT_FALSE(pty_.HasHost());
  const Descriptor again = OpenHost();
  EXPECT_TRUE(pty_.HasHost());
}

TEST_F(PtyTest, ASecondHostFindsTheLineRawToo) {
  ASSERT_EQ(ErrorText(pty_.Open(path_)), "");
  { const Descriptor host = OpenHost(); }
  const Descriptor host = OpenHost();
  termios settings{};
  ASSERT_EQ(tcgetattr(host.get(), &settings), 0);
  EXPECT_EQ(settings.c_lflag & (ICANON | ECHO | ISIG), 0U);
  EXPECT_EQ(settings.c_oflag & OPOST, 0U);
}

TEST_F(PtyTest, TellsTheHostsRate) {
  EXPECT_EQ(pty_.Baud(), 0);
  ASSERT_EQ(ErrorText(pty_.Open(path_)), "");
  const Descriptor host = OpenHost();
  termios settings{};
  ASSERT_EQ(tcgetattr(host.get(), &settings), 0);
  for (const auto& [code, rate] :
       {std::pair<speed_t, int>{B9600, 9'600}, {B19200, 19'200}, {B2500000, 2'500'000}}) {
    ASSERT_EQ(cfsetspeed(&settings, code), 0);
    ASSERT_EQ(tcsetattr(host.get(), TCSANOW, &settings), 0);
    EXPECT_EQ(pty_.Baud(), rate);
  }
}

TEST_F(PtyTest, WhatAGoneHostHasNotReadCanBeDroppedWhileTheNextOneSends) {
  ASSERT_EQ(ErrorText(pty_.Open(path_)), "");
  {
    const Descriptor gone = OpenHost();
    ASSERT_TRUE(pty_.Write(std::array<std::uint8_t, 2>{1, 2}));
  }
  const Descriptor host(open(path_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK));
  ASSERT_EQ(write(host.get(), "x", 1), 1);
  pty_.Discard();
  std::array<std::uint8_t, 8> into{};
  EXPECT_EQ(read(host.get(), into.data(), into.size()), -1);
  EXPECT_EQ(errno, EAGAIN);
  ASSERT_TRUE(Readable(pty_.FileDescriptor()));
  EXPECT_EQ(pty_.Read(into), 1U);
  EXPECT_EQ(into[0], 'x');
}

TEST_F(PtyTest, ClosingTakesTheLineFromTheHostAndTheLinkAway) {
  ASSERT_EQ(ErrorText(pty_.Open(path_)), "");
  const Descriptor host = OpenHost();
  pty_.Close();
  EXPECT_FALSE(std::filesystem::is_symlink(path_));
  EXPECT_EQ(write(host.get(), "x", 1), -1);
  EXPECT_EQ(errno, EIO);
  std::array<std::uint8_t, 8> into{};
  EXPECT_EQ(read(host.get(), into.data(), into.size()), 0);
}

TEST_F(PtyTest, OpensAgainUnderTheSameName) {
  ASSERT_EQ(ErrorText(pty_.Open(path_)), "");
  ASSERT_EQ(ErrorText(pty_.Open(path_)), "");
  const Descriptor host = OpenHost();
  ASSERT_TRUE(host.valid());
  ASSERT_TRUE(pty_.Write(Bytes(reinterpret_cast<const std::uint8_t*>("ok"), 2)));
  EXPECT_TRUE(Readable(host.get()));
}

TEST_F(PtyTest, ReplacesAStaleLinkButNoFile) {
  std::filesystem::create_symlink("/dev/pts/999999", path_);
  EXPECT_EQ(ErrorText(pty_.Open(path_)), "");
  pty_.Close();
  std::ofstream(path_) << "mine";
  EXPECT_NE(ErrorText(pty_.Open(path_)).find("no link"), std::string::npos);
  EXPECT_TRUE(std::filesystem::is_regular_file(path_));
}

TEST_F(PtyTest, LeavesTheLinkOfAnotherAlone) {
  ASSERT_EQ(ErrorText(pty_.Open(path_)), "");
  Pty other;
  ASSERT_EQ(ErrorText(other.Open(path_)), "");
  pty_.Close();
  EXPECT_TRUE(std::filesystem::is_symlink(path_));
}

TEST_F(PtyTest, NamesTheCauseWhenItCannotLink) {
  EXPECT_NE(ErrorText(pty_.Open(directory_ + "/absent/bus.pty")).find("No such file"), std::string::npos);
}

}  // namespace
}  // namespace axlecast
