#include "tools/web/web_access.h"

#include <sodium.h>

#include <algorithm>
#include <cctype>
#include <stdexcept>
#include <utility>

#include "core/config/service_config.h"
#include "core/messages/json/field.h"
#include "platform/os/process.h"

namespace axlecast {
namespace {

constexpr std::string_view kCookie = "axlecast_session";
constexpr std::string_view kBearer = "Bearer ";

// Secrets are compared by their digests, which have equal length, in constant time.
std::string DigestOf(std::string_view text) {
  std::string digest(crypto_generichash_BYTES, '\0');
  crypto_generichash(reinterpret_cast<unsigned char*>(digest.data()), digest.size(),
                     reinterpret_cast<const unsigned char*>(text.data()), text.size(), nullptr, 0);
  return digest;
}

bool SameDigest(const std::string& one, const std::string& other) {
  return one.size() == other.size() && sodium_memcmp(one.data(), other.data(), one.size()) == 0;
}

std::string Lower(std::string_view text) {
  std::string lower(text);
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char character) { return static_cast<char>(std::tolower(character)); });
  return lower;
}

// Returns the host without its port, and an IPv6 address without brackets; empty if malformed.
std::string NameOfHost(std::string_view host) {
  std::string_view port;
  std::string_view name = host;
  if (host.starts_with('[')) {
    const std::size_t end = host.find(']');
    if (end == std::string_view::npos) return "";
    name = host.substr(1, end - 1);
    port = host.substr(end + 1);
  } else if (const std::size_t colon = host.find(':'); colon != std::string_view::npos) {
    name = host.substr(0, colon);
    port = host.substr(colon);
  }
  const bool port_right = port.empty() || (port.size() > 1 && port.size() <= 6 && port.front() == ':' &&
                                           std::all_of(port.begin() + 1, port.end(), [](unsigned char character) {
                                             return std::isdigit(character) != 0;
                                           }));
  return port_right ? Lower(name) : "";
}

int HexValue(char digit) {
  if (digit >= '0' && digit <= '9') return digit - '0';
  const char lower = static_cast<char>(digit | 0x20);
  return lower >= 'a' && lower <= 'f' ? lower - 'a' + 10 : -1;
}

// Decodes "%2B" and "+". Invalid escapes stay unchanged.
std::string Unescaped(std::string_view text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool escape =
        text[i] == '%' && i + 2 < text.size() && HexValue(text[i + 1]) >= 0 && HexValue(text[i + 2]) >= 0;
    if (escape) {
      plain += static_cast<char>(HexValue(text[i + 1]) * 16 + HexValue(text[i + 2]));
      i += 2;
    } else {
      plain += text[i] == '+' ? ' ' : text[i];
    }
  }
  return plain;
}

// Returns the value after `name=` in a list with this separator.
std::string_view PartValue(std::string_view parts, std::string_view name, char separator) {
  while (!parts.empty()) {
    const std::size_t end = std::min(parts.find(separator), parts.size());
    std::string_view part = parts.substr(0, end);
    parts.remove_prefix(std::min(end + 1, parts.size()));
    part.remove_prefix(std::min(part.find_first_not_of(' '), part.size()));
    if (part.size() > name.size() && part.starts_with(name) && part[name.size()] == '=') {
      return part.substr(name.size() + 1);
    }
  }
  return "";
}

}  // namespace

std::string_view CookieValue(std::string_view header, std::string_view name) {
  return PartValue(header, name, ';');
}

std::string FormValue(std::string_view body, std::string_view name) {
  return Unescaped(PartValue(body, name, '&'));
}

WebAccess::WebAccess(Rules rules, const Secret& token)
    : rules_(std::move(rules)), token_digest_(DigestOf(token.text())) {
  if (sodium_init() < 0) throw std::runtime_error("libsodium: no source of random numbers");
  for (std::string& name : rules_.names) name = Lower(name);
}

bool WebAccess::IsHost(std::string_view host) const {
  const std::string name = NameOfHost(host);
  return name == "localhost" || IsIpAddress(name) ||
         (!name.empty() && std::find(rules_.names.begin(), rules_.names.end(), name) != rules_.names.end());
}

bool WebAccess::IsOwnOrigin(const WebRequest& request) const {
  if (request.origin.empty()) return true;
  return Lower(request.origin) == (rules_.tls ? "https://" : "http://") + Lower(request.host);
}

bool WebAccess::IsToken(std::string_view text) const {
  return rules_.token_required && SameDigest(DigestOf(text), token_digest_);
}

bool WebAccess::MayLook(const WebRequest& request, MonoNs now) const {
  if (!rules_.token_required) return true;
  if (std::string_view(request.authorization).starts_with(kBearer)) {
    return IsToken(std::string_view(request.authorization).substr(kBearer.size()));
  }
  const std::string digest = DigestOf(CookieValue(request.cookie, kCookie));
  return std::any_of(sessions_.begin(), sessions_.end(), [&](const Session& session) {
    return now < session.until && SameDigest(session.digest, digest);
  });
}

std::string WebAccess::Open(MonoNs now) {
  const std::string id = HexDigits(RandomId());
  sessions_.push_back({DigestOf(id), now + kSession});
  if (sessions_.size() > kMaxSessions) sessions_.pop_front();
  return std::string(kCookie) + '=' + id +
         "; Path=/; HttpOnly; SameSite=Strict; Max-Age=" + std::to_string(kSession / kSecond) +
         (rules_.tls ? "; Secure" : "");
}

}  // namespace axlecast
