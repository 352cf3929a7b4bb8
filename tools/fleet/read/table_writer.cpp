#include "tools/fleet/read/table_writer.h"

#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include "core/base/utc_text.h"
#include "core/messages/json/field.h"
#include "tools/convert/conversion.h"

namespace axlecast {
namespace {

constexpr std::size_t kPiece = 64U << 10;  // bytes that are written together
constexpr std::int64_t kSecondUs = 1'000'000;

template <typename Number>
void AppendNumber(std::string& text, Number value) {
  std::array<char, 32> digits{};
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), value);
  static_cast<void>(error);  // 32 characters are enough for every number
  text.append(digits.data(), end);
}

}  // namespace

std::string UtcMicrosecondText(std::int64_t unix_us) {
  std::int64_t fraction = unix_us % kSecondUs;
  if (fraction < 0) fraction += kSecondUs;
  std::string text = FormatUtc(unix_us - fraction, "%Y-%m-%dT%H:%M:%S");
  if (text == "?") return "";
  std::string digits = std::to_string(fraction);
  return text + '.' + std::string(6 - digits.size(), '0') + digits + 'Z';
}

TableWriter::TableWriter(TableFormat format, std::vector<std::string> columns, Output out)
    : format_(format), out_(std::move(out)) {
  if (format_ == TableFormat::kCsv) text_ = CsvLine(columns);
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (format_ == TableFormat::kCsv) {
      keys_.emplace_back(i == 0 ? "" : ",");
    } else {
      keys_.push_back((i == 0 ? "{" : ",") + JsonLine(columns[i]) + ':');
    }
  }
}

void TableWriter::BeginCell() {
  if (column_ == 0 && format_ == TableFormat::kJson) text_ += rows_ == 0 ? "[\n" : ",\n";
  text_ += keys_[column_++];
}

TableWriter& TableWriter::Null() {
  BeginCell();
  if (format_ != TableFormat::kCsv) text_ += "null";
  return *this;
}

TableWriter& TableWriter::Bool(bool value) {
  BeginCell();
  text_ += value ? "true" : "false";
  return *this;
}

TableWriter& TableWriter::Int(std::int64_t value) {
  BeginCell();
  AppendNumber(text_, value);
  return *this;
}

TableWriter& TableWriter::Float(double value) {
  if (!std::isfinite(value)) return Null();
  BeginCell();
  AppendNumber(text_, value);
  return *this;
}

TableWriter& TableWriter::Text(std::string_view value) {
  BeginCell();
  if (format_ == TableFormat::kCsv) {
    AppendCsvCell(text_, value);
  } else {
    text_ += JsonLine(value);
  }
  return *this;
}

TableWriter& TableWriter::Json(std::string_view json) {
  if (format_ == TableFormat::kCsv) return Text(json);
  BeginCell();
  text_ += json;
  return *this;
}

TableWriter& TableWriter::Utc(std::int64_t unix_us) {
  const std::string text = UtcMicrosecondText(unix_us);
  return text.empty() ? Null() : Text(text);
}

bool TableWriter::EndRow() {
  text_ += format_ == TableFormat::kCsv ? "\r\n" : format_ == TableFormat::kJson ? "}" : "}\n";
  column_ = 0;
  ++rows_;
  return text_.size() < kPiece ? good_ : Flush();
}

bool TableWriter::End() {
  if (format_ == TableFormat::kJson) text_ += rows_ == 0 ? "[]\n" : "\n]\n";
  return Flush();
}

bool TableWriter::Flush() {
  if (good_) good_ = text_.empty() || out_(text_);
  text_.clear();
  return good_;
}

}  // namespace axlecast
