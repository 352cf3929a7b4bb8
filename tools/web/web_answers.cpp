#include "tools/web/web_answers.h"

#include <utility>

#include "core/messages/json/field.h"

namespace axlecast {

WebAnswer PlainAnswer(int status, std::string text) { return {.status = status, .body = std::move(text) + '\n'}; }

WebAnswer ForeignHostAnswer() {
  return PlainAnswer(
      403,
      "this server does not have the name that the browser requested: use its address, or add the name to the "
      "machine's file (web: names:)");
}

WebAnswer MethodAnswer() {
  WebAnswer answer = PlainAnswer(405, "only GET and HEAD are allowed: this server accepts no commands");
  answer.headers.emplace_back("allow", "GET, HEAD");
  return answer;
}

WebAnswer MetricsAnswer(std::string metrics) {
  return {.type = "text/plain; version=0.0.4; charset=utf-8",
          .body = std::move(metrics),
          .headers = {{"cache-control", "no-store"}}};
}

WebAnswer HealthAnswer(const std::string& problem) {
  nlohmann::ordered_json json = {{"status", problem.empty() ? "ok" : "failing"}};
  if (!problem.empty()) json["reason"] = problem;
  return {.status = problem.empty() ? 200 : 503,
          .type = "application/json",
          .body = JsonLine(json) + '\n',
          .headers = {{"cache-control", "no-store"}}};
}

}  // namespace axlecast
