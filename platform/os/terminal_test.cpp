#include "platform/os/terminal.h"

#include <gtest/gtest.h>

#include <sstream>

namespace axlecast {
namespace {

constexpr const char* kMark = "\xEF\xBF\xBD";

TEST(TerminalBufferTest, PassesOnWhatIsSafeWhateverItsPieces) {
  std::ostringstream shown;
  {
    TerminalBuffer buffer(shown.rdbuf());
    std::ostream out(&buffer);
    out << std::unitbuf << "axis1 \xE2"
        << "\x80" << '\xA6' << " \x1b[2J " << 12.5 << '\x07' << "\xE2\x80";
  }
  EXPECT_EQ(shown.str(), std::string("axis1 \xE2\x80\xA6 ") + kMark + "[2J 12.5" + kMark + kMark + kMark);
}

TEST(TerminalOutputTest, StandsBeforeBothStreamsWhileItLives) {
  std::ostringstream shown;
  std::streambuf* const out = std::cout.rdbuf(shown.rdbuf());
  std::streambuf* const err = std::cerr.rdbuf(shown.rdbuf());
  {
    const TerminalOutput safe;
    std::cout << "a\rb";
    std::cerr << "c\x9b"
              << "d";
  }
  std::cout << "\r";
  std::cout.rdbuf(out);
  std::cerr.rdbuf(err);
  EXPECT_EQ(shown.str(), std::string("a") + kMark + "bc" + kMark + "d\r");
}

}  // namespace

}  // namespace axlecast
