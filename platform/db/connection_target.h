#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "platform/db/database_error.h"

namespace axlecast::db {

// One host to which a connection is tried: libpq's keywords and values.
using ConnectionKeywords = std::vector<std::pair<std::string, std::string>>;

// Splits a connection string into one set of keywords for each host, in the order of the string: libpq would wait on the first host
// that does not answer, because connect_timeout has no effect on asynchronous connections. A string without a host yields one set;
// then libpq's environment variables name the host. Fails if the string is not valid or contains a password.
[[nodiscard]] DatabaseResult<std::vector<ConnectionKeywords>> SplitHosts(const std::string& connection);

// Returns the value of a keyword; empty without it.
[[nodiscard]] std::string_view ValueOf(const ConnectionKeywords& keywords, std::string_view name);

// Returns "db1:5433/axlecast" for messages; never a password.
[[nodiscard]] std::string TargetText(const ConnectionKeywords& keywords);

}  // namespace axlecast::db
