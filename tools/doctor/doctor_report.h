#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/doctor/check.h"

namespace axlecast {

// What `axlecast doctor` says.

[[nodiscard]] std::string DiagnosisText(const Diagnosis& diagnosis);
// "2 errors, 1 warning"
[[nodiscard]] std::string CountText(const std::vector<Diagnosis>& diagnoses);
// `mended`: what --fix did, in this order.
[[nodiscard]] nlohmann::ordered_json DoctorJson(const std::string& file, const std::vector<Diagnosis>& diagnoses,
                                                const std::vector<std::string>& mended);

[[nodiscard]] std::string CheckListText();
[[nodiscard]] nlohmann::ordered_json CheckListJson();

}  // namespace axlecast
