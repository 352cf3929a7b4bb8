#pragma once

#include <deque>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/secret.h"
#include "core/base/time.h"
#include "platform/net/web_server.h"

namespace axlecast {

// Who may look: judges requests. Keeps the sessions of browsers that have signed in with the token.
class WebAccess {
 public:
  // A token that is shorter could be guessed.
  static constexpr std::size_t kShortestToken = 16;
  static constexpr MonoNs kSession = 12 * 3600 * kSecond;
  static constexpr std::size_t kMaxSessions = 64;

  struct Rules {
    std::vector<std::string> names = {};  // of this host, beside localhost and its addresses
    bool tls = false;
    bool token_required = false;
  };

  // `token` is what must be shown; empty where none is required.
  WebAccess(Rules rules, const Secret& token);

  // Whether Host names this host: an address, localhost or one of its names. A page of another origin whose name was
  // made to point here (DNS rebinding) sends that name.
  [[nodiscard]] bool IsHost(std::string_view host) const;
  // Whether the request does not come from a page of another origin. Programs send no Origin.
  [[nodiscard]] bool IsOwnOrigin(const WebRequest& request) const;
  // Whether the request shows the token or a session's cookie, or needs neither.
  [[nodiscard]] bool MayLook(const WebRequest& request, MonoNs now) const;

  [[nodiscard]] bool IsToken(std::string_view text) const;
  // A new session: the value of Set-Cookie.
  [[nodiscard]] std::string Open(MonoNs now);

 private:
  struct Session {
    std::string digest;
    MonoNs until = 0;
  };

  Rules rules_;
  std::string token_digest_;
  std::deque<Session> sessions_;  // oldest first
};

// The value of the cookie `name` in a Cookie header; empty where there is none.
[[nodiscard]] std::string_view CookieValue(std::string_view header, std::string_view name);

// The value of `name` in a form's body (application/x-www-form-urlencoded); empty where there is none.
[[nodiscard]] std::string FormValue(std::string_view body, std::string_view name);

}  // namespace axlecast
