#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tools/doctor/host_facts.h"
#include "tools/doctor/symptom.h"

namespace axlecast {

using Symptoms = std::vector<Symptom>;

// One thing that a host must have right for a machine. Its texts are those of docs/doctor.md.
struct Check {
  std::string_view name;  // stable: scripts know it
  Severity severity;
  std::string_view looks_at;  // what is right
  std::string_view effect;    // of a finding, for the machine
  Symptoms (*run)(const MachineConfig& machine, const HostFacts& host);
};

// All of them, by area: network and machine, ports, CAN, real time, disk, keys.
[[nodiscard]] std::span<const Check> Checks();
[[nodiscard]] const Check* FindCheck(std::string_view name);

struct Diagnosis {
  const Check* check = nullptr;
  Symptom symptom;
};
// Returns true if there is no error and no warning. This is the exit code 0 of doctor (docs/cli.md, "Good"): advice is no
// fault, because a script would otherwise never see a good host.
[[nodiscard]] bool AdviceAlone(const std::vector<Diagnosis>& diagnoses);

// Runs the checks that `wanted` takes.
[[nodiscard]] std::vector<Diagnosis> Diagnose(const MachineConfig& machine, const HostFacts& host,
                                              const std::function<bool(const Check&)>& wanted);

}  // namespace axlecast
