#include "tools/metrics/exposition.h"

#include <array>
#include <charconv>
#include <cmath>

#include "core/base/text.h"

namespace axlecast {
namespace {

std::string_view TypeName(Exposition::Type type) {
  static constexpr std::array<std::string_view, 3> kNames = {"counter", "gauge", "histogram"};
  return kNames.at(static_cast<std::size_t>(type));
}

std::string Escaped(std::string_view value) {
  std::string text;
  for (const char c : TerminalText(MendedUtf8(value))) {
    if (c == '\n') {
      text += "\\n";
      continue;
    }
    if (c == '\\' || c == '"') text += '\\';
    text += c;
  }
  return text;
}

}  // namespace

std::string MetricNumber(double value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0 ? "+Inf" : "-Inf";
  std::array<char, 32> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
  return {digits.data(), end};
}

void Exposition::Family(std::string_view name, Type type, std::string_view help) {
  name_ = name;
  samples_.clear();
  header_ =
      "# HELP " + name_ + ' ' + std::string(help) + "\n# TYPE " + name_ + ' ' + std::string(TypeName(type)) + '\n';
}

void Exposition::Add(std::string_view suffix, Labels labels, double value) {
  AddText(suffix, labels, MetricNumber(value));
}

void Exposition::Add(std::string_view suffix, Labels labels, std::int64_t value) {
  AddText(suffix, labels, std::to_string(value));
}

void Exposition::AddText(std::string_view suffix, Labels labels, std::string_view value) {
  std::string sample = name_ + std::string(suffix);
  char before = '{';
  for (const auto& [label, text] : labels) {
    sample += before + std::string(label) + "=\"" + Escaped(text) + '"';
    before = ',';
  }
  if (labels.size() > 0) sample += '}';
  if (!samples_.insert(sample).second) return;
  text_ += std::exchange(header_, "");
  text_ += sample + ' ' + std::string(value) + '\n';
}

}  // namespace axlecast
