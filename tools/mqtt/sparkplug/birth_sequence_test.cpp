#include "tools/mqtt/sparkplug/birth_sequence.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "tests/support/temporary_folder.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;

class BirthSequenceTest : public ::testing::Test {
 protected:
  void Write(const std::string& text) { std::ofstream(file_, std::ios::binary) << text; }
  std::string Content() const {
    std::ostringstream text;
    text << std::ifstream(file_).rdbuf();
    return text.str();
  }

  TemporaryFolder folder_;
  std::string file_ = folder_.path() + "/bdseq";
};

TEST_F(BirthSequenceTest, BeginsAtZeroAndCounts) {
  BirthSequence sequence(file_);
  EXPECT_EQ(sequence.Next(), 0);
  EXPECT_EQ(sequence.Next(), 1);
  EXPECT_EQ(sequence.problem(), "");
  EXPECT_EQ(Content(), "bdSeq 1\n");
}

TEST_F(BirthSequenceTest, GoesOnAfterARestartAndWraps) {
  Write("bdSeq 254\n");
  BirthSequence sequence(file_);
  EXPECT_EQ(sequence.Next(), 255);
  EXPECT_EQ(BirthSequence(file_).Next(), 0);
  EXPECT_EQ(BirthSequence(file_).Next(), 1);
}

TEST_F(BirthSequenceTest, DamagedContentIsReportedAndReplaced) {
  for (const std::string& text :
       {std::string(), std::string("bdSeq 25"), std::string("bdSeq 256\n"), std::string("bdSeq -1\n"),
        std::string("bdSeq 1 \n"), std::string("17\n"), std::string(4096, '\0'), std::string("bdSeq \n")}) {
    Write(text);
    BirthSequence sequence(file_);
    EXPECT_EQ(sequence.Next(), 0) << text;
    EXPECT_THAT(sequence.problem(), HasSubstr(file_));
    EXPECT_EQ(Content(), "bdSeq 0\n");
    EXPECT_EQ(sequence.Next(), 1);
    EXPECT_EQ(sequence.problem(), "");
  }
}

TEST_F(BirthSequenceTest, GoesOnWithoutADisk) {
  BirthSequence sequence(folder_.path() + "/missing/bdseq");
  EXPECT_EQ(sequence.Next(), 0);
  EXPECT_THAT(sequence.problem(), HasSubstr("missing"));
  EXPECT_EQ(sequence.Next(), 1);
}

}  // namespace
}  // namespace axlecast
