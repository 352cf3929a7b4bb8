// Linked to a mutated test program: chooses the mutant, and writes which mutants each case of the tests reaches.

#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <string>

#include "tests/mutation/schema.h"

namespace axlecast_mutation {
namespace {

// Writes one line for each case: its name, its time in ms, and the numbers of the mutants that it reached. "*" as a case is
// what was reached before its suite, or before all suites.
class ReachedWriter : public testing::EmptyTestEventListener {
 public:
  explicit ReachedWriter(const std::string& path) : file_(path) {}

  void OnTestProgramStart(const testing::UnitTest& /*program*/) override { Write("*", 0); }
  void OnTestStart(const testing::TestInfo& test) override { Write(std::string(test.test_suite_name()) + ".*", 0); }
  void OnTestEnd(const testing::TestInfo& test) override {
    Write(std::string(test.test_suite_name()) + "." + test.name(), test.result()->elapsed_time());
  }

 private:
  void Write(const std::string& name, testing::TimeInMillis ms) {
    file_ << name << ' ' << ms;
    for (int id = 1; id < kMaxMutants; ++id) {
      if (reached[id] != 0) file_ << ' ' << id;
      reached[id] = 0;
    }
    file_ << std::endl;
  }

  std::ofstream file_;
};

const bool kListens = [] {
  if (const char* path = std::getenv("AXLECAST_MUTANTS_REACHED")) {
    testing::UnitTest::GetInstance()->listeners().Append(new ReachedWriter(path));
  }
  return true;
}();

}  // namespace

int mutant = -1;
unsigned char reached[kMaxMutants];

// Before the initialisers of all objects, which may already call mutated code.
__attribute__((constructor(101))) void Choose() {
  if (const char* text = std::getenv("AXLECAST_MUTANT")) mutant = std::atoi(text);
}

}  // namespace axlecast_mutation
