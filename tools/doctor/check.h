#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tools/doctor/host_facts.h"
#include "tools/doctor/symptom.h"

namespace axlecast {

using Symptoms = std::vector<Symptom>;

// One condition that a host must meet for a machine. docs/doctor.md has the same texts.
struct Check {
  std::string_view name;  // stable: scripts use it
  Severity severity;
  std::string_view looks_at;  // the condition
  std::string_view effect;    // on the machine, if the condition is not met
  Symptoms (*run)(const MachineConfig& machine, const HostFacts& host);
};

// All checks by area: network and machine, ports, CAN, real time, disk, keys.
[[nodiscard]] std::span<const Check> Checks();
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
// `fixed`: the lines that --fix has applied, in order.
[[nodiscard]] nlohmann::ordered_json DoctorJson(const std::string& file, const std::vector<Diagnosis>& diagnoses,
                                                const std::vector<std::string>& fixed);

[[nodiscard]] std::string CheckListText();
[[nodiscard]] nlohmann::ordered_json CheckListJson();

}  // namespace axlecast
