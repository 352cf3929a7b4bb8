#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace axlecast::db {

// Values as PostgreSQL writes and reads them as text. Pure.

// Parses a timestamptz in ISO style with any offset: "2026-11-27 10:49:47.123456+00". Returns UNIX time in us; nothing for other
// texts, infinity, and times beyond years 1000 to 9999.
[[nodiscard]] std::optional<std::int64_t> ParseDatabaseTime(std::string_view text);

// Formats UNIX time in us for timestamptz; "-infinity" or "infinity" beyond years 1000 to 9999.
[[nodiscard]] std::string DatabaseTimeText(std::int64_t unix_us);

// Parses a bytea in hex format: "\x00ff".
[[nodiscard]] std::optional<std::string> ParseBytea(std::string_view text);

// Formats exactly; "NaN", "Infinity".
[[nodiscard]] std::string FloatText(double value);

// Returns the text with U+FFFD in place of what PostgreSQL refuses in a text: bytes that are not UTF-8, and NUL.
[[nodiscard]] std::string DatabaseText(std::string_view text);

// Returns the JSON text with \ufffd in place of \u0000, which jsonb refuses.
[[nodiscard]] std::string JsonbText(std::string_view json);

// Returns an element of an array literal: quoted, escaped.
[[nodiscard]] std::string QuotedElement(std::string_view text);

}  // namespace axlecast::db
