#include "tools/axlecast/fleet/metrics_server.h"

#ifdef AXLECAST_WITHOUT_WEB

namespace axlecast {

Result<std::unique_ptr<MetricsServer>> StartMetricsServer(const ListenAddress& /*listen*/,
                                                          std::vector<std::string> /*names*/,
                                                          std::function<std::string()> /*metrics*/) {
  return Failure(
      "metrics: this axlecast is built without a web server; remove --metrics and `ship: metrics`, or build it "
      "with "
      "-DAXLECAST_WEB=ON");
}

}  // namespace axlecast

#else

#include <iostream>
#include <thread>
#include <utility>

#include "platform/net/web_server.h"
#include "tools/web/metrics_site.h"
#include "tools/web/web_access.h"

namespace axlecast {
namespace {

constexpr int kMaxConnections = 16;

class HttpMetrics final : public MetricsServer {
 public:
  HttpMetrics(const ListenAddress& listen, std::vector<std::string> names, std::function<std::string()> metrics)
      : access_({.names = std::move(names)}, Secret()),
        site_(access_, std::move(metrics)),
        server_({.address = listen.address,
                 .port = listen.port,
                 .max_connections = kMaxConnections,
                 .max_per_address = kMaxConnections / 2,
                 .headers = {{"x-content-type-options", "nosniff"}}},
                site_) {
    if (!server_.problem().empty()) return;
    thread_ = std::thread([this] {
      if (!server_.Run()) std::cerr << "metrics are no longer served: the server's library failed\n";
    });
  }
  ~HttpMetrics() override {
    site_.End();
    if (thread_.joinable()) thread_.join();
  }
  HttpMetrics(const HttpMetrics&) = delete;
  HttpMetrics& operator=(const HttpMetrics&) = delete;

  [[nodiscard]] const std::string& problem() const { return server_.problem(); }

 private:
  WebAccess access_;
  MetricsSite site_;
  WebServer server_;
  std::thread thread_;
};

}  // namespace

Result<std::unique_ptr<MetricsServer>> StartMetricsServer(const ListenAddress& listen,
                                                          std::vector<std::string> names,
                                                          std::function<std::string()> metrics) {
  auto server = std::make_unique<HttpMetrics>(listen, std::move(names), std::move(metrics));
  if (!server->problem().empty()) return Failure("metrics: " + server->problem());
  return server;
}

}  // namespace axlecast

#endif
