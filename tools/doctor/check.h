#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "tools/doctor/host_facts.h"

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
  std::vector<std::string> words = {};
  std::string path = {};
  std::string text = {};
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
  std::string found = {};
  std::vector<Fix> fixes = {};
  bool safe = false;  // `--fix` may apply the fixes: they disturb nothing that runs and open nothing to others
};

using Symptoms = std::vector<Symptom>;

// One condition that a host must meet for a machine. docs/doctor.md has the same texts.
struct Check {
  std::string_view name;  // stable: scripts use it
  Severity severity;
  std::string_view looks_at;  // the condition
  std::string_view effect;    // on the machine, if the condition is not met
  Symptoms (*run)(const MachineConfig& machine, const HostFacts& host);
};

// The checks by area: LCM between the processes of a machine, with other machines and reported faults; serial ports, SPI
// devices and GPIO chips; CAN interfaces; real time; the folders of logs and journal; keys, accounts and the machine file.
[[nodiscard]] std::span<const Check> NetworkChecks();
[[nodiscard]] std::span<const Check> PortChecks();
[[nodiscard]] std::span<const Check> CanChecks();
[[nodiscard]] std::span<const Check> TimeChecks();
[[nodiscard]] std::span<const Check> DiskChecks();
[[nodiscard]] std::span<const Check> KeyChecks();

// All checks, in this order.
[[nodiscard]] const std::vector<Check>& Checks();
[[nodiscard]] const Check* FindCheck(std::string_view name);

struct Diagnosis {
  const Check* check = nullptr;
  Symptom symptom;
};

// Runs the checks that `selected` accepts.
[[nodiscard]] std::vector<Diagnosis> Diagnose(const MachineConfig& machine, const HostFacts& host,
                                              const std::function<bool(const Check&)>& selected);

// Returns true if there is no error and no warning: exit code 0 of doctor (docs/cli.md, "Good"). Advice does not count,
// because almost every host gets some.
[[nodiscard]] bool AdviceAlone(const std::vector<Diagnosis>& diagnoses);

[[nodiscard]] std::string DiagnosisText(const Diagnosis& diagnosis);
// Returns a text like "2 errors, 1 warning".
[[nodiscard]] std::string CountText(const std::vector<Diagnosis>& diagnoses);
// Returns the interface that each LCM URL of the machine uses, by URL; an empty name if it uses none.
[[nodiscard]] std::map<std::string, std::string> LcmInterfaces(const HostFacts& host);

// Returns what keeps UNIX time, with chronyd also its claim: "kept by chronyd from 10.0.0.1, which claims +-0.020 ms".
[[nodiscard]] std::string ClockText(const HostFacts& host);

// `fixed`: the lines that --fix has applied, in order. `interfaces`: LcmInterfaces. `clock`: ClockText.
[[nodiscard]] nlohmann::ordered_json DoctorJson(const std::string& file, const std::vector<Diagnosis>& diagnoses,
                                                const std::vector<std::string>& fixed,
                                                const std::map<std::string, std::string>& interfaces,
                                                const std::string& clock);

[[nodiscard]] std::string CheckListText();
[[nodiscard]] nlohmann::ordered_json CheckListJson();

}  // namespace axlecast
