#include "core/base/markup.h"

#include "core/base/terminal_text.h"
#include "core/base/utf8.h"

namespace axlecast {
namespace {

// U+FFFE and U+FFFF, which XML 1.0, 2.2, leaves out.
std::string WithoutNoncharacters(std::string text) {
  for (const std::string_view code : {"\xEF\xBF\xBE", "\xEF\xBF\xBF"}) {
    for (std::size_t at = 0; (at = text.find(code, at)) != std::string::npos;) text.replace(at, 3, "\xEF\xBF\xBD");
  }
  return text;
}

}  // namespace

std::string EscapedMarkup(std::string_view text) {
  std::string escaped;
  for (const char c : WithoutNoncharacters(TerminalText(MendedUtf8(text)))) {
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
        escaped += c;
    }
  }
  return escaped;
}

}  // namespace axlecast
