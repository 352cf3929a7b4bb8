#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "core/base/text.h"
#include "platform/db/value_text.h"

// Texts of a server that could be anything. A time that is parsed must be formatted to the same time.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace axlecast;                                                // NOLINT(google-build-using-namespace)
  const std::string_view text(reinterpret_cast<const char*>(data), size);  // NOLINT
  if (const auto time = db::ParseDatabaseTime(text)) {
    const std::string again = db::DatabaseTimeText(*time);
    if (!again.ends_with("infinity") && db::ParseDatabaseTime(again) != time) __builtin_trap();
  }
  if (const auto bytes = db::ParseBytea(text); bytes && bytes->size() * 2 + 2 != size) __builtin_trap();
  const std::string clean = db::DatabaseText(text);
  if (clean.find('\0') != std::string::npos || MendedUtf8(clean) != clean) __builtin_trap();
  static_cast<void>(db::JsonbText(text));
  static_cast<void>(db::QuotedElement(text));
  return 0;
}
