#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace axlecast {

// One line that mends something, as an operator types it as root, and as `--fix` does it.
struct Fix {
  enum class Kind : std::uint8_t {
    kRun,     // words: a program and its arguments
    kWrite,   // text into the kernel's file `path`
    kAppend,  // text as a line of the file `path`, where the system finds it at its next start
    kTell,    // text alone: what only the operator can judge or do
  };

  Kind kind = Kind::kTell;
  std::vector<std::string> words;
  std::string path;
  std::string text;
};
[[nodiscard]] Fix Run(std::vector<std::string> words);
[[nodiscard]] Fix Write(std::string path, std::string text);
[[nodiscard]] Fix Append(std::string path, std::string text);
[[nodiscard]] Fix Tell(std::string text);
[[nodiscard]] std::string LineOf(const Fix& fix);

enum class Severity : std::uint8_t {
  kError,    // something of the machine does not work
  kWarning,  // it works, and will lose or delay something one day
  kAdvice,   // it could be better
};
[[nodiscard]] std::string_view SeverityName(Severity severity);

// Something that one check found. What it does to the machine is the check's `effect`.
struct Symptom {
  std::string found;
  std::vector<Fix> fixes;
  bool safe = false;  // `--fix` may apply the fixes: nothing that runs is disturbed, nothing is opened to others
};

}  // namespace axlecast
