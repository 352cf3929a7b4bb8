#include "tools/axlecast/common/subcommands.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/spelling.h"
#include "core/config/hosts.h"
#include "core/config/load.h"
#include "core/messages/json/field.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/program.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/doctor/check.h"
#include "tools/doctor/host_facts.h"

namespace axlecast {
namespace {

struct DoctorOptions {
  ConfigOption config;
  std::string host;
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
    "It opens no port, and changes nothing without --fix. Without a machine's file, it checks only the host.\n"
    "Each check, its effect and its fix: docs/doctor.md.\n"
    "Exit code: 0 nothing found but advice, 1 an error or a warning, or the file has errors, 2 usage.\n"
    "\n"
    "Examples:\n"
    "  axlecast doctor machine.yaml\n"
    "  sudo axlecast doctor machine.yaml --fix          # shows each fix, asks, applies it, checks again\n"
    "  axlecast doctor --json | jq -r '.findings[].name'\n"
    "  axlecast doctor --only multicast_route,firewall\n"
    "  axlecast doctor --list";

bool Contains(const std::vector<std::string>& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

// Fails if --only or --skip has an unknown name.
Result<> CheckNames(const DoctorOptions& options) {
  std::vector<std::string> known;
  for (const Check& check : Checks()) known.emplace_back(check.name);
  for (const auto* names : {&options.only, &options.skip}) {
    for (const std::string& name : *names) {
      if (Contains(known, name)) continue;
      const std::optional<std::string> near = NearestWord(name, known);
      return Failure("there is no check " + Quoted(name) +
                     (near ? "; did you mean '" + *near + "'?" : "; --list shows all checks"));
    }
  }
  return {};
}

struct Examination {
  std::vector<Diagnosis> diagnoses;
  std::map<std::string, std::string> interfaces;  // LcmInterfaces
  std::string clock;                              // ClockText
};

Examination Examine(const DoctorOptions& options, const MachineConfig& machine) {
  const auto selected = [&options](const Check& check) {
    return (options.only.empty() || Contains(options.only, check.name)) && !Contains(options.skip, check.name);
  };
  const auto needs = [&selected](const char* check) { return selected(*FindCheck(check)); };
  ReadHostOptions reading{.files = HostFiles(options.root)};
  reading.read_machine = needs("machine_faults");
  reading.listen = needs("other_machine") || needs("duplicate_driver") || reading.read_machine
                       ? static_cast<MonoNs>(options.listen_s * static_cast<double>(kSecond))
                       : 0;
  const HostFacts host = ReadHost(machine, reading);
  return {Diagnose(machine, host, selected), LcmInterfaces(host), ClockText(host)};
}

// Applies the safe fixes and adds them to `applied`. After a failure, the further fixes of the same diagnosis are skipped.
void ApplyFixes(const DoctorOptions& options, const std::vector<Diagnosis>& diagnoses,
                std::vector<std::string>& applied) {
  const HostFiles files(options.root);
  for (const Diagnosis& diagnosis : diagnoses) {
    if (!diagnosis.symptom.safe) continue;
    std::cerr << DiagnosisText(diagnosis);
    if (!options.yes && !Confirmed()) continue;
    for (const Fix& fix : diagnosis.symptom.fixes) {
      if (fix.kind == Fix::Kind::kManual) continue;
      if (const Result<> done = ApplyFix(fix, files); !done) {
        std::cerr << "  not done: " << done.error().text << '\n';
        break;
      }
      applied.push_back(LineOf(fix));
    }
  }
}

bool AnySafe(const std::vector<Diagnosis>& diagnoses) {
  return std::any_of(diagnoses.begin(), diagnoses.end(), [](const Diagnosis& one) { return one.symptom.safe; });
}

void Report(const DoctorOptions& options, const MachineConfig& machine, const Examination& examination,
            const std::vector<std::string>& applied) {
  const std::vector<Diagnosis>& diagnoses = examination.diagnoses;
  if (options.json) {
    std::cout << JsonLine(DoctorJson(machine.file, diagnoses, applied, examination.interfaces, examination.clock))
              << '\n';
    return;
  }
  if (options.only.empty()) {
    for (const auto& [url, interface] : examination.interfaces) {
      if (!interface.empty()) std::cout << url << " uses " << Printable(interface) << '\n';
    }
    std::cout << "UNIX time is " << Printable(examination.clock) << '\n';
  }
  for (const std::string& line : applied) std::cout << "done: " << line << '\n';
  for (const Diagnosis& diagnosis : diagnoses) std::cout << DiagnosisText(diagnosis);
  if (!diagnoses.empty()) std::cout << CountText(diagnoses) << '\n';
}

int Doctor(const DoctorOptions& options) {
  if (const Result<> known = CheckNames(options); !known) {
    return Fail("axlecast doctor: " + known.error().text, kExitUsage);
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
    Result<MachineConfig> part = PartOn(*loaded, ThisHost(options.host));
    if (!part) return Fail(part.error().text, kExitBad);
    machine = std::move(*part);
  }
  Examination examination = Examine(options, machine);
  std::vector<std::string> applied;
  if (options.fix && AnySafe(examination.diagnoses)) {
    if (!options.yes && !CanAsk("doctor --fix")) return kExitUsage;
    ApplyFixes(options, examination.diagnoses, applied);
    if (!applied.empty()) examination = Examine(options, machine);
  }
  Report(options, machine, examination, applied);
  return AdviceAlone(examination.diagnoses) ? kExitDone : kExitBad;
}

}  // namespace

void AddDoctorCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<DoctorOptions>();
  CLI::App* command = app.add_subcommand(
      "doctor", "Check this host for a machine; show each problem, its effect, and the line that fixes it");
  options->config.AddTo(*command, ConfigOption::Form::kPositional);
  AddHostOption(*command, options->host);
  command->add_flag("--fix", options->fix, "Apply the safe fixes, each after a confirmation");
  command->add_flag("--yes", options->yes, "With --fix: do not ask");
  // Each takes one word, so that the machine's file can follow.
  const auto add_names = [command](const char* option, std::vector<std::string>& names, const char* help) {
    command->add_option(option, names, help)->delimiter(',')->allow_extra_args(false)->type_name("CHECK,...");
  };
  add_names("--only", options->only, "Only these checks, separated by commas");
  add_names("--skip", options->skip, "All checks except these");
  command
      ->add_option("--listen", options->listen_s,
                   "Time to listen for drivers of this and other machines, in seconds; 0: do not listen")
      ->check(CLI::Range(0.0, 60.0))
      ->capture_default_str();
  command->add_option("--root", options->root, "Check and fix /proc, /sys, /dev and /etc below this folder")
      ->type_name("DIR")
      ->check(CLI::ExistingDirectory);
  command->add_flag("--list", options->list, "List all checks, and check nothing");
  command->add_flag("--json", options->json,
                    "Print one object: file, ok, findings, `mended`, interfaces, clock; with --list: checks");
  command->footer(kExamples);
  command->callback([options, &exit_code] { exit_code = Doctor(*options); });
}

}  // namespace axlecast
