#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "tools/doctor/host/host_files.h"

namespace axlecast {

// One step that fixes a symptom, as an operator types it as root and as `--fix` applies it.
struct Fix {
  enum class Kind : std::uint8_t {
    kRun,     // words: a program and its arguments
    kWrite,   // text into the kernel's file `path`
    kAppend,  // text as a line of the file `path`, which the system reads at its next start
    kManual,  // text alone: a step that only the operator can decide or do
  };

  Kind kind = Kind::kManual;
  std::vector<std::string> words;
  std::string path;
  std::string text;
};
[[nodiscard]] Fix Run(std::vector<std::string> words);
[[nodiscard]] Fix Write(std::string path, std::string text);
[[nodiscard]] Fix Append(std::string path, std::string text);
[[nodiscard]] Fix Manual(std::string text);

// Returns the line that an operator types, quoted for a shell.
[[nodiscard]] std::string LineOf(const Fix& fix);

// Applies the fix to the host that `files` shows. A manual fix is skipped.
[[nodiscard]] Result<> ApplyFix(const Fix& fix, const HostFiles& files);

enum class Severity : std::uint8_t {
  kError,    // a part of the machine does not work
  kWarning,  // it works now, but will lose or delay data under some conditions
  kAdvice,   // it can be improved
};
[[nodiscard]] std::string_view SeverityName(Severity severity);

// What one check has found. Its effect on the machine is Check::effect.
struct Symptom {
  std::string found;
  std::vector<Fix> fixes;
  bool safe = false;  // `--fix` may apply the fixes: they disturb nothing that runs and open nothing to others
};

}  // namespace axlecast
