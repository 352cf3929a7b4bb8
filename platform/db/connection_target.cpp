#include "platform/db/connection_target.h"

#include <libpq-fe.h>

#include <algorithm>
#include <array>
#include <memory>

namespace axlecast::db {
namespace {

constexpr std::array<std::string_view, 3> kLists{"host", "hostaddr", "port"};

tl::unexpected<DatabaseError> Bad(const std::string& reason) {
  return tl::unexpected(DatabaseError{{"the connection string of the database is not valid: " + reason + ". " +
                                       std::string(RemedyOf(DatabaseFault::kBadConnection))},
                                      DatabaseFault::kBadConnection,
                                      ""});
}

std::vector<std::string> Elements(std::string_view list) {
  std::vector<std::string> elements;
  for (std::size_t at = 0; at <= list.size();) {
    const std::size_t comma = std::min(list.find(',', at), list.size());
    elements.emplace_back(list.substr(at, comma - at));
    at = comma + 1;
  }
  return elements;
}

// libpq's message, but for those that repeat a word of the string, which may be a password without its keyword.
std::string ParseFailure(char* message) {
  const std::unique_ptr<char, decltype(&PQfreemem)> owned(message, &PQfreemem);
  std::string text = message != nullptr ? message : "out of memory";
  while (text.ends_with('\n')) text.pop_back();
  const std::size_t quote = text.find('"');
  if (text.starts_with("invalid connection option") || quote == std::string::npos) return text;
  return "each word must be KEYWORD=VALUE";
}

DatabaseResult<ConnectionKeywords> Parse(const std::string& connection) {
  char* message = nullptr;
  const std::unique_ptr<PQconninfoOption, decltype(&PQconninfoFree)> options(
      PQconninfoParse(connection.c_str(), &message), &PQconninfoFree);
  if (!options) return Bad(ParseFailure(message));
  ConnectionKeywords keywords;
  for (const PQconninfoOption* option = options.get(); option->keyword != nullptr; ++option) {
    if (option->val != nullptr) keywords.emplace_back(option->keyword, option->val);
  }
  return keywords;
}

}  // namespace

std::string_view ValueOf(const ConnectionKeywords& keywords, std::string_view name) {
  const auto found = std::ranges::find_if(keywords, [&](const auto& keyword) { return keyword.first == name; });
  return found == keywords.end() ? std::string_view() : std::string_view(found->second);
}

DatabaseResult<std::vector<ConnectionKeywords>> SplitHosts(const std::string& connection) {
  const auto keywords = Parse(connection);
  if (!keywords) return tl::unexpected(keywords.error());
  for (const std::string_view secret : {"password", "sslpassword"}) {
    if (!ValueOf(*keywords, secret).empty()) {
      return Bad(
          "it contains a " + std::string(secret) +
          ", which every user of the host can read there: keep it in a file with mode 0600 and name the file");
    }
  }
  std::size_t hosts = 1;
  for (const std::string_view name : {"host", "hostaddr"})
    hosts = std::max(hosts, Elements(ValueOf(*keywords, name)).size());
  std::vector<ConnectionKeywords> split(hosts);
  for (const auto& [name, value] : *keywords) {
    const auto elements = std::ranges::find(kLists, name) != kLists.end() ? Elements(value) : std::vector{value};
    if (elements.size() != 1 && elements.size() != hosts) {
      return Bad("host, hostaddr and port must list equally many elements, or port one");
    }
    for (std::size_t i = 0; i < hosts; ++i)
      split[i].emplace_back(name, elements.size() == 1 ? elements[0] : elements[i]);
  }
  return split;
}

std::string TargetText(const ConnectionKeywords& keywords) {
  std::string_view host = ValueOf(keywords, "host");
  if (host.empty()) host = ValueOf(keywords, "hostaddr");
  std::string text = host.empty() ? "the default host" : std::string(host);
  if (const auto port = ValueOf(keywords, "port"); !port.empty()) text.append(":").append(port);
  if (const auto name = ValueOf(keywords, "dbname"); !name.empty()) text.append("/").append(name);
  return text;
}

}  // namespace axlecast::db
