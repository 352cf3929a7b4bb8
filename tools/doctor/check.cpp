#include "tools/doctor/check.h"

#include <algorithm>
#include <array>
#include <utility>

#include "core/base/text.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

std::string CountedWord(std::ptrdiff_t count, const std::string& what, const std::string& plural) {
  return count == 0 ? "" : std::to_string(count) + ' ' + (count == 1 ? what : plural);
}

Json DiagnosisJson(const Diagnosis& diagnosis) {
  const Check& check = *diagnosis.check;
  Json json = {{"name", check.name},
               {"severity", SeverityName(check.severity)},
               {"found", diagnosis.symptom.found},
               {"effect", check.effect},
               {"mend", Json::array()},
               {"safe", diagnosis.symptom.safe}};
  for (const Fix& fix : diagnosis.symptom.fixes) json["mend"].push_back(LineOf(fix));
  return json;
}

}  // namespace

Fix Run(std::vector<std::string> words) { return {.kind = Fix::Kind::kRun, .words = std::move(words)}; }

Fix Write(std::string path, std::string text) {
  return {.kind = Fix::Kind::kWrite, .path = std::move(path), .text = std::move(text)};
}

Fix Append(std::string path, std::string text) {
  return {.kind = Fix::Kind::kAppend, .path = std::move(path), .text = std::move(text)};
}

Fix Manual(std::string text) { return {.kind = Fix::Kind::kManual, .text = std::move(text)}; }

std::string LineOf(const Fix& fix) {
  switch (fix.kind) {
    case Fix::Kind::kRun:
      return ShellText(fix.words);
    case Fix::Kind::kWrite:
      return ShellText({"echo", fix.text}) + " > " + ShellText({fix.path});
    case Fix::Kind::kAppend:
      return ShellText({"echo", fix.text}) + " >> " + ShellText({fix.path});
    case Fix::Kind::kManual:
      break;
  }
  return fix.text;
}

std::string_view SeverityName(Severity severity) {
  constexpr std::array<std::string_view, 3> kNames = {"error", "warning", "advice"};
  return kNames.at(static_cast<std::size_t>(severity));
}

Result<> ApplyFix(const Fix& fix, const HostFiles& files) {
  switch (fix.kind) {
    case Fix::Kind::kRun:
      if (const auto output = RunProgram(LineOf(fix)); !output) return Failure(output.error());
      break;
    case Fix::Kind::kWrite:
      return WriteValue(files.Place(fix.path), fix.text);
    case Fix::Kind::kAppend:
      return AppendLine(files.Place(fix.path), fix.text);
    case Fix::Kind::kManual:
      break;
  }
  return {};
}

const std::vector<Check>& Checks() {
  static const std::vector<Check> kChecks = [] {
    std::vector<Check> checks;
    for (const auto area : {NetworkChecks(), PortChecks(), CanChecks(), TimeChecks(), DiskChecks(), KeyChecks()}) {
      checks.insert(checks.end(), area.begin(), area.end());
    }
    return checks;
  }();
  return kChecks;
}

const Check* FindCheck(std::string_view name) {
  const auto found = std::ranges::find_if(Checks(), [name](const Check& check) { return check.name == name; });
  return found == Checks().end() ? nullptr : &*found;
}

bool AdviceAlone(const std::vector<Diagnosis>& diagnoses) {
  return std::ranges::all_of(diagnoses,
                             [](const Diagnosis& one) { return one.check->severity == Severity::kAdvice; });
}

std::vector<Diagnosis> Diagnose(const MachineConfig& machine, const HostFacts& host,
                                const std::function<bool(const Check&)>& selected) {
  std::vector<Diagnosis> all;
  for (const Check& check : Checks()) {
    if (!selected(check)) continue;
    for (Symptom& symptom : check.run(machine, host)) all.push_back({&check, std::move(symptom)});
  }
  return all;
}

std::string DiagnosisText(const Diagnosis& diagnosis) {
  const Check& check = *diagnosis.check;
  std::string text = std::string(SeverityName(check.severity)) + ' ' + std::string(check.name) + ": " +
                     diagnosis.symptom.found + "\n  " + std::string(check.effect) + '\n';
  text += diagnosis.symptom.safe ? "  As root, or with --fix:\n" : "  As root:\n";
  for (const Fix& fix : diagnosis.symptom.fixes) text += "    " + LineOf(fix) + '\n';
  return text;
}

std::string CountText(const std::vector<Diagnosis>& diagnoses) {
  const auto count = [&](Severity severity) {
    return std::ranges::count_if(diagnoses,
                                 [severity](const Diagnosis& one) { return one.check->severity == severity; });
  };
  std::string text;
  for (const std::string& part : {CountedWord(count(Severity::kError), "error", "errors"),
                                  CountedWord(count(Severity::kWarning), "warning", "warnings"),
                                  CountedWord(count(Severity::kAdvice), "piece of advice", "pieces of advice")}) {
    if (!part.empty()) text += (text.empty() ? "" : ", ") + part;
  }
  return text.empty() ? "nothing found" : text;
}

std::map<std::string, std::string> LcmInterfaces(const HostFacts& host) {
  std::map<std::string, std::string> interfaces;
  for (const auto& [url, group] : host.network.groups) interfaces.emplace(url, group.route.interface);
  return interfaces;
}

Json DoctorJson(const std::string& file, const std::vector<Diagnosis>& diagnoses,
                const std::vector<std::string>& fixed, const std::map<std::string, std::string>& interfaces,
                const std::string& clock) {
  Json json = {
      {"file", file.empty() ? Json() : Json(file)}, {"ok", AdviceAlone(diagnoses)}, {"findings", Json::array()}};
  for (const Diagnosis& diagnosis : diagnoses) json["findings"].push_back(DiagnosisJson(diagnosis));
  json["mended"] = fixed;
  json["interfaces"] = interfaces;
  json["clock"] = clock;
  return json;
}

std::string CheckListText() {
  std::string text;
  for (const Check& check : Checks()) {
    text += Left(check.name, 24) + Left(SeverityName(check.severity), 9) + std::string(check.looks_at) + '\n';
  }
  return text;
}

Json CheckListJson() {
  Json list = Json::array();
  for (const Check& check : Checks()) {
    list.push_back({{"name", check.name},
                    {"severity", SeverityName(check.severity)},
                    {"looks_at", check.looks_at},
                    {"effect", check.effect}});
  }
  return {{"checks", list}};
}

}  // namespace axlecast
