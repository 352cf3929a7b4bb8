#pragma once

#include <string>

#include "platform/net/web_server.h"

namespace axlecast {

// Answers to programs: metrics, health, refusals. Those with data of the moment are not cached.

// Returns the text as one line.
[[nodiscard]] WebAnswer PlainAnswer(int status, std::string text);

// Refuses a request for a host that WebAccess does not accept.
[[nodiscard]] WebAnswer ForeignHostAnswer();

// Refuses another method than GET and HEAD.
[[nodiscard]] WebAnswer MethodAnswer();

// `metrics`: Prometheus' text exposition format.
[[nodiscard]] WebAnswer MetricsAnswer(std::string metrics);

// `problem`: why the program does not work; empty: it works.
[[nodiscard]] WebAnswer HealthAnswer(const std::string& problem);

}  // namespace axlecast
