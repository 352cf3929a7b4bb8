#include "platform/db/copy_rows.h"

#include <bit>
#include <cassert>
#include <limits>

#include "platform/db/value_text.h"

namespace axlecast::db {
namespace {

// Signature, flags (no OIDs) and length of the header's extension.
constexpr std::string_view kHeader("PGCOPY\n\377\r\n\0\0\0\0\0\0\0\0\0", 19);
constexpr std::int64_t kPostgresEpoch = 946'684'800'000'000;  // us, 2000-01-01
// datatype/timestamp.h, MIN_TIMESTAMP and END_TIMESTAMP: 4714-11-24 BC up to, not including, 294277-01-01.
constexpr std::int64_t kMinTimestamp = -211'813'488'000'000'000;
constexpr std::int64_t kEndTimestamp = 9'223'371'331'200'000'000;
constexpr std::uint8_t kJsonbVersion = 1;
constexpr std::uint32_t kInt8Type = 20;  // OID (pg_type.dat)

template <typename T>
void Append(std::string& bytes, T value) {
  for (std::size_t i = sizeof(T); i-- > 0;) bytes.push_back(static_cast<char>((value >> (8 * i)) & 0xFFU));
}

}  // namespace

void CopyRow::Size(std::size_t size) {
  assert(size <= static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max()));
  Append(bytes_, static_cast<std::uint32_t>(size));
}

CopyRow& CopyRow::Null() {
  Append(bytes_, std::uint32_t{0xFFFFFFFF});
  return *this;
}

CopyRow& CopyRow::Bool(bool value) {
  Size(1);
  bytes_.push_back(value ? '\1' : '\0');
  return *this;
}

CopyRow& CopyRow::Int2(std::int16_t value) {
  Size(sizeof value);
  Append(bytes_, static_cast<std::uint16_t>(value));
  return *this;
}

CopyRow& CopyRow::Int4(std::int32_t value) {
  Size(sizeof value);
  Append(bytes_, static_cast<std::uint32_t>(value));
  return *this;
}

CopyRow& CopyRow::Int8(std::int64_t value) {
  Size(sizeof value);
  Append(bytes_, static_cast<std::uint64_t>(value));
  return *this;
}

CopyRow& CopyRow::Float4(float value) {
  Size(sizeof value);
  Append(bytes_, std::bit_cast<std::uint32_t>(value));
  return *this;
}

CopyRow& CopyRow::Float8(double value) {
  Size(sizeof value);
  Append(bytes_, std::bit_cast<std::uint64_t>(value));
  return *this;
}

CopyRow& CopyRow::Text(std::string_view value) {
  const std::string text = DatabaseText(value);
  Size(text.size());
  bytes_ += text;
  return *this;
}

CopyRow& CopyRow::Binary(Bytes value) {
  Size(value.size());
  bytes_.append(value.begin(), value.end());
  return *this;
}

CopyRow& CopyRow::Timestamp(std::int64_t unix_us) { return Int8(PostgresMicroseconds(unix_us)); }

CopyRow& CopyRow::Jsonb(std::string_view json) {
  const std::string text = JsonbText(json);
  Size(text.size() + 1);
  bytes_.push_back(static_cast<char>(kJsonbVersion));
  bytes_ += text;
  return *this;
}

CopyRow& CopyRow::Uuid(std::span<const std::uint8_t, 16> value) { return Binary(value); }

CopyRow& CopyRow::Int8Array(std::span<const std::int64_t> values) {
  constexpr std::size_t kFixed = 20;  // dimensions, flags, type; length and lower bound of the dimension
  constexpr std::size_t kElement = 12;
  if (values.empty()) {
    Size(12);
    Append(bytes_, std::uint32_t{0});  // dimensions
    Append(bytes_, std::uint32_t{0});  // no NULL
    Append(bytes_, kInt8Type);
    return *this;
  }
  Size(kFixed + kElement * values.size());
  Append(bytes_, std::uint32_t{1});
  Append(bytes_, std::uint32_t{0});
  Append(bytes_, kInt8Type);
  Append(bytes_, static_cast<std::uint32_t>(values.size()));
  Append(bytes_, std::uint32_t{1});
  for (const std::int64_t value : values) Int8(value);
  return *this;
}

CopyRows::CopyRows(int columns) : columns_(columns) { Clear(); }

CopyRow CopyRows::Row() {
  ++rows_;
  Append(bytes_, static_cast<std::uint16_t>(columns_));
  return CopyRow(bytes_);
}

void CopyRows::Clear() {
  rows_ = 0;
  bytes_ = kHeader;
}

std::int64_t PostgresMicroseconds(std::int64_t unix_us) {
  if (unix_us < kMinTimestamp + kPostgresEpoch) return std::numeric_limits<std::int64_t>::min();
  // No UNIX time of 64 bits reaches kEndTimestamp.
  static_assert(std::numeric_limits<std::int64_t>::max() - kPostgresEpoch < kEndTimestamp);
  return unix_us - kPostgresEpoch;
}

}  // namespace axlecast::db
