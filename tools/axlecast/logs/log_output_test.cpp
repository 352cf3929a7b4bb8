#include "tools/axlecast/logs/log_output.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "platform/os/mapped_file.h"
#include "tests/support/temporary_folder.h"
#include "tools/axlecast/logs/log_report.h"
#include "tools/log/log_event.h"
#include "tools/log/log_reader.h"

namespace axlecast {
namespace {

using testing::HasSubstr;

class LogOutputTest : public testing::Test {
 protected:
  [[nodiscard]] LogCheck::Report Check() const {
    const MappedFile file(path_);
    EXPECT_EQ(file.problem(), "");
    LogCheck check;
    LogReader reader(file.bytes());
    for (auto event = reader.Next(); event; event = reader.Next()) {
      check.Add(*event, reader.offset(), file.bytes().subspan(reader.offset(), EventSize(*event)));
    }
    EXPECT_TRUE(reader.damage().empty());
    return check.Finish();
  }
  const TemporaryFolder folder_;
  const std::string path_ = folder_.path() + "/out.log";
};

TEST_F(LogOutputTest, IsNumberedAndSealed) {
  {
    LogOutput out(path_, 0600);
    const std::vector<std::uint8_t> data(3'000);
    for (std::int64_t i = 0; i < 5'000; ++i) {
      out.Add({.number = 77, .utime = i * 1'000, .channel = "A", .data = data});
    }
    EXPECT_FALSE(std::filesystem::exists(path_));
    EXPECT_TRUE(out.Commit(false));
    EXPECT_EQ(out.events(), 5'000);
  }
  const LogCheck::Report report = Check();
  EXPECT_TRUE(report.IsSound());
  EXPECT_EQ(report.seals, 5) << "one a second, and at the end";
  EXPECT_EQ(report.events, 5'005);
  EXPECT_EQ(report.unsealed, 0);
  EXPECT_EQ(report.missing, 0);
}

TEST_F(LogOutputTest, TakesNoSealsAndEachHeaderOnce) {
  LogOutput out(path_, 0600);
  const std::vector<std::uint8_t> data = {1, 2};
  out.Add({.channel = kMachineChannel, .data = data});
  out.Add({.channel = kMachineChannel, .data = data});
  out.Add({.channel = kMachineChannel, .data = Bytes(data).first(1)});
  out.Add({.channel = kSealChannel, .data = data});
  EXPECT_EQ(out.events(), 2);
  EXPECT_TRUE(out.Commit(false));
  EXPECT_EQ(Check().events, 3);
}

TEST_F(LogOutputTest, AnEmptyOneIsAnEmptyFile) {
  LogOutput out(path_, 0600);
  EXPECT_TRUE(out.Commit(false));
  EXPECT_EQ(std::filesystem::file_size(path_), 0U);
}

TEST_F(LogOutputTest, SaysWhyItCannotBeWritten) {
  LogOutput out(folder_.path() + "/none/out.log", 0600);
  out.Add({.channel = "A", .data = {}});
  EXPECT_THAT(out.Commit(false).error().text, HasSubstr("No such file"));
}

}  // namespace
}  // namespace axlecast
