#include "tools/axlecast/run/simulation_server.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/stat.h>

#include <atomic>
#include <filesystem>
#include <string>
#include <thread>

#include "tests/support/temporary_folder.h"

namespace axlecast {
namespace {

class ControlSocketTest : public testing::Test {
 protected:
  ControlSocketTest() { path_ = directory_ + "/bus.ctl"; }

  // Serves until `ask` has returned.
  std::string WhileServing(ControlSocket& socket, const std::function<std::string()>& ask) {
    std::atomic<bool> done = false;
    std::thread server([&] {
      while (!done) {
        pollfd wanted{socket.FileDescriptor(), POLLIN, 0};
        if (poll(&wanted, 1, 10) > 0) socket.Serve([](const std::string& question) { return "re: " + question; });
      }
    });
    std::string answer = ask();
    done = true;
    server.join();
    return answer;
  }

  const TemporaryFolder folder_;
  const std::string directory_ = folder_.path();
  std::string path_;
};

TEST_F(ControlSocketTest, AnswersOneQuestionPerCaller) {
  ControlSocket socket;
  ASSERT_EQ(ErrorText(socket.Listen(path_)), "");
  EXPECT_EQ(WhileServing(socket, [&] { return AskControlSocket(path_, "a") + AskControlSocket(path_, "b"); }),
            "re: are: b");
}

TEST_F(ControlSocketTest, IsOursAlone) {
  ControlSocket socket;
  ASSERT_EQ(ErrorText(socket.Listen(path_)), "");
  struct stat status {};
  ASSERT_EQ(stat(path_.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0600U);
}

TEST_F(ControlSocketTest, NobodyThereIsNoAnswer) {
  EXPECT_EQ(AskControlSocket(path_, "a"), "");
  {
    ControlSocket gone;
    ASSERT_EQ(ErrorText(gone.Listen(path_)), "");
  }
  EXPECT_FALSE(std::filesystem::exists(path_));
}

TEST_F(ControlSocketTest, TakesOverWhatACrashLeft) {
  ControlSocket crashed;
  ASSERT_EQ(ErrorText(crashed.Listen(path_)), "");
  ControlSocket socket;
  ASSERT_EQ(ErrorText(socket.Listen(path_)), "");
  EXPECT_EQ(WhileServing(socket, [&] { return AskControlSocket(path_, "a"); }), "re: a");
}

TEST_F(ControlSocketTest, EmptyQuestionsKeepNobodyOut) {
  ControlSocket socket;
  ASSERT_EQ(ErrorText(socket.Listen(path_)), "");
  const std::string answer = WhileServing(socket, [&] {
    for (int i = 0; i < 40; ++i) EXPECT_EQ(AskControlSocket(path_, ""), "");
    return AskControlSocket(path_, "a");
  });
  EXPECT_EQ(answer, "re: a");
}

TEST_F(ControlSocketTest, ATooLongPathIsNamed) {
  ControlSocket socket;
  const std::string problem = ErrorText(socket.Listen(directory_ + '/' + std::string(120, 'x')));
  EXPECT_NE(problem.find("AXLECAST_RUN_DIR"), std::string::npos);
}

}  // namespace
}  // namespace axlecast
