#include <cstdlib>

#include "tools/web/web_access.h"

// No Host, Origin, Cookie, Authorization or form gives access without the token.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using axlecast::Secret;
  using axlecast::WebAccess;
  static WebAccess access({.names = {"press3"}, .tls = true, .token_required = true},
                          Secret("correct horse battery staple"));
  static const std::string session = access.Open(0);
  const std::string text(reinterpret_cast<const char*>(data), size);
  static_cast<void>(access.IsHost(text));
  if (access.IsHost(text + ".evil.example")) std::abort();
  if (access.IsOwnOrigin({.host = "press3", .origin = "http://evil.example" + text})) std::abort();
  const bool shows_token = text.find("correct horse battery staple") != std::string::npos;
  const bool shows_session = text.find(session.substr(0, session.find(';'))) != std::string::npos;
  if (access.MayLook({.cookie = text, .authorization = text}, 1) && !shows_token && !shows_session) std::abort();
  if (access.IsToken(axlecast::FormValue(text, "token")) && text.find("staple") == std::string::npos &&
      text.find('%') == std::string::npos) {
    std::abort();
  }
  if (axlecast::FormValue(text, "token").size() > size) std::abort();
  return 0;
}
