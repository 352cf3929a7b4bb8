#include "tools/axlecast/setup/subcommands.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/spelling.h"
#include "core/config/load.h"
#include "core/messages/json/field.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/doctor/check.h"
#include "tools/doctor/host_facts.h"

namespace axlecast {
namespace {

struct DoctorOptions {
  ConfigOption config;
  std::vector<std::string> only;
  std::vector<std::string> skip;
  std::string root;
  double listen_s = 1.5;
  bool list = false;
  bool fix = false;
  bool yes = false;
  bool json = false;
};

constexpr const char* kExamples =
    "It opens no port and changes nothing, unless --fix says so. Without a machine's file only the host is looked "
    "at.\n"
    "Each check, its effect and what mends it: docs/doctor.md.\n"
    "Exit code: 0 nothing found but advice, 1 an error or a warning, or the file has mistakes, 2 usage.\n"
    "\n"
    "Examples:\n"
    "  axlecast doctor machine.yaml\n"
    "  sudo axlecast doctor machine.yaml --fix          # shows each line, asks, does it, looks again\n"
    "  axlecast doctor --json | jq -r '.findings[].name'\n"
    "  axlecast doctor --only multicast_route,firewall\n"
    "  axlecast doctor --list";

bool Contains(const std::vector<std::string>& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

std::string UnknownName(const DoctorOptions& options) {
  std::vector<std::string> known;
  for (const Check& check : Checks()) known.emplace_back(check.name);
  for (const auto* names : {&options.only, &options.skip}) {
    for (const std::string& name : *names) {
      if (Contains(known, name)) continue;
      const std::optional<std::string> near = NearestWord(name, known);
      return "there is no check " + Quoted(name) +
             (near ? "; did you mean '" + *near + "'?" : "; --list names them");
    }
  }
  return "";
}

std::vector<Diagnosis> Examine(const DoctorOptions& options, const MachineConfig& machine) {
  const auto wanted = [&options](const Check& check) {
    return (options.only.empty() || Contains(options.only, check.name)) && !Contains(options.skip, check.name);
  };
  const auto listens = [&wanted](const char* name) { return wanted(*FindCheck(name)); };
  ReadHostOptions reading{.files = HostFiles(options.root)};
  reading.read_machine = listens("machine_faults");
  reading.listen = listens("other_machine") || listens("duplicate_driver") || reading.read_machine
                       ? static_cast<MonoNs>(options.listen_s * static_cast<double>(kSecond))
                       : 0;
  return Diagnose(machine, ReadHost(machine, reading), wanted);
}

// Applies the fixes of what is safe, and says which; the first that fails ends those of its finding.
void Mend(const DoctorOptions& options, const std::vector<Diagnosis>& diagnoses, std::vector<std::string>& mended) {
  const HostFiles files(options.root);
  for (const Diagnosis& diagnosis : diagnoses) {
    if (!diagnosis.symptom.safe) continue;
    std::cerr << DiagnosisText(diagnosis);
    if (!options.yes && !Confirmed()) continue;
    for (const Fix& fix : diagnosis.symptom.fixes) {
      if (fix.kind == Fix::Kind::kManual) continue;
      if (const Result<> applied = ApplyFix(fix, files); !applied) {
        std::cerr << "  not done: " << applied.error().text << '\n';
        break;
      }
      mended.push_back(LineOf(fix));
    }
  }
}

bool AnySafe(const std::vector<Diagnosis>& diagnoses) {
  return std::any_of(diagnoses.begin(), diagnoses.end(), [](const Diagnosis& one) { return one.symptom.safe; });
}

void Report(const DoctorOptions& options, const MachineConfig& machine, const std::vector<Diagnosis>& diagnoses,
            const std::vector<std::string>& mended) {
  if (options.json) {
    std::cout << JsonLine(DoctorJson(machine.file, diagnoses, mended)) << '\n';
    return;
  }
  for (const std::string& line : mended) std::cout << "done: " << line << '\n';
  for (const Diagnosis& diagnosis : diagnoses) std::cout << DiagnosisText(diagnosis);
  if (!diagnoses.empty()) std::cout << CountText(diagnoses) << '\n';
}

int Doctor(const DoctorOptions& options) {
  if (const std::string problem = UnknownName(options); !problem.empty()) {
    std::cerr << "axlecast doctor: " << problem << '\n';
    return kExitUsage;
  }
  if (options.list) {
    std::cout << (options.json ? JsonLine(CheckListJson()) + '\n' : CheckListText());
    return kExitDone;
  }
  MachineConfig machine;
  if (!options.config.File().empty()) {
    ConfigErrors errors(options.config.File());
    std::optional<MachineConfig> loaded = LoadConfig(options.config.File(), errors, {}, ConfigWriters::kAnyone);
    if (!loaded) {
      std::cerr << errors.Text();
      return kExitBad;
    }
    machine = std::move(*loaded);
  }
  std::vector<Diagnosis> diagnoses = Examine(options, machine);
  std::vector<std::string> mended;
  if (options.fix && AnySafe(diagnoses)) {
    if (!options.yes && !CanAsk("doctor --fix")) return kExitUsage;
    Mend(options, diagnoses, mended);
    if (!mended.empty()) diagnoses = Examine(options, machine);
  }
  Report(options, machine, diagnoses, mended);
  return AdviceAlone(diagnoses) ? kExitDone : kExitBad;
}

// One word, so that the machine's file may follow.
void AddNames(CLI::App& command, const char* option, std::vector<std::string>& names, const char* what) {
  command.add_option(option, names, what)->delimiter(',')->allow_extra_args(false)->type_name("CHECK,...");
}

}  // namespace

void AddDoctorCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<DoctorOptions>();
  CLI::App* command = app.add_subcommand(
      "doctor", "Checks this host for a machine; says what is wrong, what that does, and the line that mends it");
  options->config.AddTo(*command, ConfigOption::Form::kPositional);
  command->add_flag("--fix", options->fix, "Applies the fixes that are safe, each after a question");
  command->add_flag("--yes", options->yes, "With --fix: asks nothing");
  AddNames(*command, "--only", options->only, "Only these checks, with commas between");
  AddNames(*command, "--skip", options->skip, "All but these");
  command
      ->add_option("--listen", options->listen_s,
                   "Seconds to listen for drivers, of this machine and of others; 0: not at all")
      ->check(CLI::Range(0.0, 60.0))
      ->capture_default_str();
  command->add_option("--root", options->root, "Reads and mends /proc, /sys, /dev and /etc below this folder")
      ->type_name("DIR")
      ->check(CLI::ExistingDirectory);
  command->add_flag("--list", options->list, "Names all checks, and looks at nothing");
  command->add_flag("--json", options->json, "One object: file, ok, findings, mended; with --list: checks");
  command->footer(kExamples);
  command->callback([options, &exit_code] { exit_code = Doctor(*options); });
}

}  // namespace axlecast
