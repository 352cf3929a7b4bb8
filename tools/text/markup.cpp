#include "tools/text/markup.h"

#include "tools/text/utf8.h"

namespace axlecast {
namespace {

// What neither markup nor a reader takes: control characters but for tab and newline.
bool IsPrintable(char c) { return c == '\t' || c == '\n' || (static_cast<unsigned char>(c) >= 0x20 && c != 0x7F); }

}  // namespace

std::string EscapedMarkup(std::string_view text) {
  std::string escaped;
  for (const char c : MendedUtf8(text)) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      case '\'':
        escaped += "&#39;";
        break;
      default:
        escaped += IsPrintable(c) ? std::string(1, c) : "\xEF\xBF\xBD";
    }
  }
  return escaped;
}

}  // namespace axlecast
