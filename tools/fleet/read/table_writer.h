#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace axlecast {

enum class TableFormat : std::uint8_t {
  kCsv,    // RFC 4180, with a first line of names
  kJson,   // one array of objects
  kJsonl,  // one object a line
};

// Writes rows of named columns as text, in pieces of a few kilobytes, so that an answer of any size needs little memory. The values
// of a row follow each other in the order of the columns:
//
//   TableWriter table(TableFormat::kCsv, {"utime", "value"}, out);
//   table.Int(utime).Float(value).EndRow();
//
// An unknown value (Null, NaN, infinite) is an empty cell in CSV, and null in JSON. Numbers have as many digits as are needed to read
// the same number again.
class TableWriter {
 public:
  // Takes the next piece. Returns false if it cannot be written; then the rest is ignored.
  using Output = std::function<bool(std::string_view)>;

  TableWriter(TableFormat format, std::vector<std::string> columns, Output out);

  TableWriter& Null();
  TableWriter& Bool(bool value);
  TableWriter& Int(std::int64_t value);
  TableWriter& Float(double value);
  TableWriter& Text(std::string_view value);
  // A value that is JSON already: text in CSV, the value itself in JSON. It must be valid.
  TableWriter& Json(std::string_view json);
  // A time as text: "2026-11-21T07:00:05.123456Z". `unix_us`: UNIX time in us.
  TableWriter& Utc(std::int64_t unix_us);

  // Ends the row. Returns false if the output has failed.
  bool EndRow();
  // Writes the rest. Returns false if the output has failed. Call it once, behind the last row.
  bool End();

  [[nodiscard]] std::int64_t rows() const { return rows_; }
  [[nodiscard]] bool good() const { return good_; }

 private:
  void BeginCell();
  bool Flush();

  TableFormat format_;
  std::vector<std::string> keys_;  // as they precede a value
  Output out_;
  std::string text_;
  std::size_t column_ = 0;
  std::int64_t rows_ = 0;
  bool good_ = true;
};

// Returns "2026-11-21T07:00:05.123456Z"; "" if the calendar does not reach so far. `unix_us`: UNIX time in us.
[[nodiscard]] std::string UtcMicrosecondText(std::int64_t unix_us);

}  // namespace axlecast
