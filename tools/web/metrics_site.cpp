#include "tools/web/metrics_site.h"

#include "tools/web/web_answers.h"

namespace axlecast {

WebAnswer MetricsSite::OnRequest(const WebRequest& request) {
  if (!access_.IsHost(request.host)) return ForeignHostAnswer();
  if (request.method != "GET" && request.method != "HEAD") return MethodAnswer();
  if (request.path == "/metrics") return MetricsAnswer(metrics_());
  if (request.path == "/healthz") return HealthAnswer("");
  return PlainAnswer(404, "this server has only /metrics and /healthz");
}

}  // namespace axlecast
