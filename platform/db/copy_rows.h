#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "core/base/inline_bytes.h"

namespace axlecast::db {

// Rows in PostgreSQL's binary COPY format (manual, COPY, "Binary Format"), ready for Database::Copy. Pure: no connection is needed.
//
//   CopyRows rows(3);
//   rows.Row().Timestamp(utime).Int8(counts).Null();
//   if (const auto copied = database.Copy("axlecast.odd(t, counts, text)", rows); !copied) …
//
// A row must have exactly as many columns as the constructor states, and each must have the type of the table's column: PostgreSQL
// converts nothing here.
class CopyRows;

// Appends the columns of one row, from left to right. Valid until the next call of CopyRows::Row.
class CopyRow {
 public:
  explicit CopyRow(std::string& bytes) : bytes_(bytes) {}

  CopyRow& Null();
  CopyRow& Bool(bool value);
  CopyRow& Int2(std::int16_t value);
  CopyRow& Int4(std::int32_t value);
  CopyRow& Int8(std::int64_t value);
  CopyRow& Float4(float value);
  CopyRow& Float8(double value);
  // Text in UTF-8. What is not UTF-8 and NUL become U+FFFD, because PostgreSQL refuses both.
  CopyRow& Text(std::string_view value);
  CopyRow& Binary(Bytes value);  // bytea
  // UNIX time in us. Times before 4713 BC become -infinity.
  CopyRow& Timestamp(std::int64_t unix_us);
  CopyRow& Jsonb(std::string_view json);  // NUL escapes (\u0000) become U+FFFD: jsonb cannot hold them
  CopyRow& Uuid(std::span<const std::uint8_t, 16> value);
  CopyRow& Int8Array(std::span<const std::int64_t> values);  // int8[]

  template <typename T, typename Append>
  CopyRow& Optional(const T& value, Append append) {  // for std::optional: Optional(x, &CopyRow::Int8)
    return value ? (this->*append)(*value) : Null();
  }

 private:
  void Size(std::size_t size);

  std::string& bytes_;
};

class CopyRows {
 public:
  explicit CopyRows(int columns);

  // Begins a row.
  [[nodiscard]] CopyRow Row();

  [[nodiscard]] std::size_t size() const { return rows_; }           // rows
  [[nodiscard]] std::size_t bytes() const { return bytes_.size(); }  // encoded
  [[nodiscard]] bool empty() const { return rows_ == 0; }
  [[nodiscard]] std::string_view encoded() const { return bytes_; }  // header and rows, without the trailer
  void Clear();

 private:
  int columns_;
  std::size_t rows_ = 0;
  std::string bytes_;
};

// Returns microseconds since 2000-01-01, as PostgreSQL counts them, of a UNIX time in us; its -infinity before 4713 BC.
[[nodiscard]] std::int64_t PostgresMicroseconds(std::int64_t unix_us);

}  // namespace axlecast::db
