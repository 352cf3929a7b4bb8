#include "tools/web/metrics_site.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

class MetricsSiteTest : public ::testing::Test {
 protected:
  WebAnswer Request(const std::string& path, const std::string& method = "GET",
                    const std::string& host = "127.0.0.1:8381") {
    return site_.OnRequest({.method = method, .path = path, .host = host});
  }

  WebAccess access_{{.names = {"press3"}}, Secret()};
  int count_ = 0;
  MetricsSite site_{access_, [this] { return "axlecast_up " + std::to_string(++count_) + '\n'; }};
};

TEST_F(MetricsSiteTest, ServesTheMetricsOfTheMoment) {
  EXPECT_EQ(Request("/metrics").body, "axlecast_up 1\n");
  const WebAnswer answer = Request("/metrics");
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(answer.body, "axlecast_up 2\n");
  EXPECT_EQ(answer.type, "text/plain; version=0.0.4; charset=utf-8");
}

TEST_F(MetricsSiteTest, ServesItsHealth) {
  EXPECT_EQ(Request("/healthz").status, 200);
  EXPECT_EQ(Request("/healthz", "HEAD").body, "{\"status\":\"ok\"}\n");
}

TEST_F(MetricsSiteTest, RefusesEverythingElse) {
  for (const char* path : {"/", "/login", "/metrics/", "/index.html", "", "/../metrics"}) {
    EXPECT_EQ(Request(path).status, 404) << path;
  }
  EXPECT_EQ(Request("/metrics", "POST").status, 405);
  EXPECT_EQ(Request("/metrics", "").status, 405);
  EXPECT_EQ(site_.OnUpgrade({.method = "GET", .path = "/ws", .host = "127.0.0.1"}), 404);
  EXPECT_EQ(count_, 0);
}

TEST_F(MetricsSiteTest, RefusesAForeignHostName) {
  EXPECT_EQ(Request("/metrics", "GET", "evil.example").status, 403);
  EXPECT_EQ(Request("/metrics", "GET", "").status, 403);
  EXPECT_EQ(count_, 0);
  EXPECT_EQ(Request("/metrics", "GET", "press3:8381").status, 200);
}

TEST_F(MetricsSiteTest, EndsWhenItIsRequested) {
  EXPECT_TRUE(site_.OnTick());
  site_.End();
  EXPECT_FALSE(site_.OnTick());
}

}  // namespace
}  // namespace axlecast
