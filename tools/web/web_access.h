#pragma once

#include <deque>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/secret.h"
#include "core/base/time.h"
#include "platform/net/web_server.h"

namespace axlecast {

// Checks whether requests are allowed. Stores the sessions of browsers that have signed in with the token.
class WebAccess {
 public:
  // A shorter token could be guessed.
  static constexpr std::size_t kMinTokenLength = 16;
  static constexpr MonoNs kSession = 12 * 3600 * kSecond;
  static constexpr std::size_t kMaxSessions = 64;

  struct Rules {
    std::vector<std::string> names = {};  // of this host, in addition to localhost and its addresses
    bool tls = false;
    bool token_required = false;
  };

  // `token` is the required token; empty if none is required.
  WebAccess(Rules rules, const Secret& token);

  // Returns true if the Host header has an address, localhost or a name of this host. This refuses DNS rebinding, where a
  // page of another origin sends its own name.
  [[nodiscard]] bool IsHost(std::string_view host) const;
  // Returns false for a request from a page of another origin. Programs other than browsers send no Origin.
  [[nodiscard]] bool IsOwnOrigin(const WebRequest& request) const;
  // Returns true if the request has the token or the cookie of a session, or if no token is required.
  [[nodiscard]] bool MayLook(const WebRequest& request, MonoNs now) const;

  [[nodiscard]] bool IsToken(std::string_view text) const;
  // Opens a session and returns the value of Set-Cookie.
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

// Returns the value of the cookie `name` in a Cookie header; empty if it is missing.
[[nodiscard]] std::string_view CookieValue(std::string_view header, std::string_view name);

// Returns the value of `name` in a form body (application/x-www-form-urlencoded), or "" if it is missing.
[[nodiscard]] std::string FormValue(std::string_view body, std::string_view name);

}  // namespace axlecast
