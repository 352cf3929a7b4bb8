#include "tools/doctor/doctor_report.h"

#include <algorithm>

#include "core/base/text.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

std::string Counted(std::ptrdiff_t count, const std::string& what, const std::string& plural) {
  return count == 0 ? "" : std::to_string(count) + ' ' + (count == 1 ? what : plural);
}

Json FindingJson(const Diagnosis& diagnosis) {
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
    return std::count_if(diagnoses.begin(), diagnoses.end(),
                         [severity](const Diagnosis& one) { return one.check->severity == severity; });
  };
  std::string text;
  for (const std::string& part : {Counted(count(Severity::kError), "error", "errors"),
                                  Counted(count(Severity::kWarning), "warning", "warnings"),
                                  Counted(count(Severity::kAdvice), "piece of advice", "pieces of advice")}) {
    if (!part.empty()) text += (text.empty() ? "" : ", ") + part;
  }
  return text.empty() ? "nothing found" : text;
}

Json DoctorJson(const std::string& file, const std::vector<Diagnosis>& diagnoses,
                const std::vector<std::string>& mended) {
  Json json = {
      {"file", file.empty() ? Json() : Json(file)}, {"ok", AdviceAlone(diagnoses)}, {"findings", Json::array()}};
  for (const Diagnosis& diagnosis : diagnoses) json["findings"].push_back(FindingJson(diagnosis));
  json["mended"] = mended;
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
