#include "tools/web/web_app.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/support/fake_clock.h"
#include "tools/log/log_fixture.h"
#include "tools/log/log_merge.h"
#include "tools/monitor/test_one_axis.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

const std::string kToken = "0123456789abcdef";

class WebSiteTest : public ::testing::Test {
 protected:
  WebSiteTest() { Build({}); }

  void Build(WebAccess::Rules rules, FleetWorker* fleet = nullptr) {
    access_ = std::make_unique<WebAccess>(rules, Secret(kToken));
    WebSiteParts parts;
    parts.clock = &clock_;
    parts.access = access_.get();
    parts.files = files_;
    parts.max_clients = 2;
    parts.live = &model_;
    parts.fleet = fleet;
    parts.tick = [] { return true; };
    parts.problem = [this] { return problem_; };
    parts.metrics = [] { return std::string("axlecast_up 1\n"); };
    site_ = std::make_unique<WebApp>(std::move(parts));
  }

  WebAnswer Get(const std::string& path, WebRequest request = {}) {
    request.method = "GET";
    request.path = path;
    if (request.host.empty()) request.host = "127.0.0.1:8380";
    return site_->OnRequest(request);
  }
  WebAnswer SignIn(const std::string& token, const std::string& origin = "http://127.0.0.1:8380") {
    return site_->OnRequest(
        {.method = "POST", .path = "/login", .host = "127.0.0.1:8380", .origin = origin, .body = "token=" + token});
  }
  int Upgrade(const WebRequest& request) { return site_->OnUpgrade(request); }
  static std::string HeaderOf(const WebAnswer& answer, const std::string& name) {
    for (const auto& [label, value] : answer.headers) {
      if (label == name) return value;
    }
    return "";
  }
  std::string NextType(WebConnection connection) {
    const WebFrame frame = site_->NextFrame(connection);
    return frame.text ? nlohmann::json::parse(*frame.text)["type"].get<std::string>() : "";
  }

  FakeClock clock_;
  MachineConfig machine_ = OneAxis();
  WebModel model_{machine_, "1", std::nullopt};
  std::array<PageFile, 3> files_ = {PageFile{"index.html", "text/html; charset=utf-8", "\"abc\"", "<p>the page"},
                                    PageFile{"login.html", "text/html; charset=utf-8", "\"def\"", "<p>sign in"},
                                    PageFile{"main.js", "text/javascript; charset=utf-8", "\"123\"", "main()"}};
  std::string problem_;
  std::unique_ptr<WebAccess> access_;
  std::unique_ptr<WebApp> site_;
};

TEST_F(WebSiteTest, ServesItsFiles) {
  const WebAnswer page = Get("/");
  EXPECT_EQ(page.status, 200);
  EXPECT_EQ(page.body, "<p>the page");
  EXPECT_EQ(page.type, "text/html; charset=utf-8");
  EXPECT_EQ(HeaderOf(page, "etag"), "\"abc\"");
  EXPECT_EQ(Get("/main.js").body, "main()");
  for (const char* path : {"/none.js", "//main.js", "/../etc/passwd", "/main.js/", "/MAIN.JS"}) {
    EXPECT_EQ(Get(path).status, 404) << path;
  }
}

TEST_F(WebSiteTest, SendsAFileAgainOnlyWhenItIsAnother) {
  EXPECT_EQ(Get("/main.js", {.if_none_match = "\"123\""}).status, 304);
  EXPECT_THAT(Get("/main.js", {.if_none_match = "\"123\""}).body, IsEmpty());
  EXPECT_EQ(Get("/main.js", {.if_none_match = "\"124\""}).status, 200);
}

TEST_F(WebSiteTest, AnswersUnderItsOwnNamesOnly) {
  EXPECT_EQ(Get("/", {.host = "evil.example"}).status, 403);
  EXPECT_EQ(Get("/metrics", {.host = "evil.example:8380"}).status, 403);
  EXPECT_EQ(Upgrade({.path = "/ws", .host = "evil.example"}), 403);
  EXPECT_EQ(Upgrade({.path = "/ws", .host = "127.0.0.1", .origin = "http://evil.example"}), 403);
}

TEST_F(WebSiteTest, ChangesNothing) {
  for (const char* method : {"POST", "PUT", "DELETE", "OPTIONS", ""}) {
    EXPECT_EQ(site_->OnRequest({.method = method, .path = "/", .host = "localhost"}).status, 405) << method;
  }
}

TEST_F(WebSiteTest, WithATokenNothingOfTheMachineIsSeenWithoutIt) {
  Build({.token_required = true});
  EXPECT_EQ(Get("/").status, 401);
  EXPECT_EQ(Get("/").body, "<p>sign in");
  EXPECT_EQ(Get("/metrics").status, 401);
  EXPECT_EQ(Upgrade({.path = "/ws", .host = "127.0.0.1:8380"}), 401);
  EXPECT_EQ(Get("/healthz").status, 200);
  EXPECT_EQ(SignIn("wrong").status, 401);
  EXPECT_EQ(SignIn(kToken, "http://evil.example").status, 403);
}

TEST_F(WebSiteTest, OpensWithTheToken) {
  Build({.token_required = true});
  const WebAnswer answer = SignIn(kToken);
  EXPECT_EQ(answer.status, 303);
  EXPECT_EQ(HeaderOf(answer, "location"), "/");
  std::string cookie = HeaderOf(answer, "set-cookie");
  EXPECT_THAT(cookie, HasSubstr("HttpOnly"));
  cookie.resize(cookie.find(';'));
  EXPECT_EQ(Get("/", {.cookie = cookie}).body, "<p>the page");
  EXPECT_EQ(Upgrade({.path = "/ws", .host = "127.0.0.1:8380", .cookie = cookie}), 0);
  EXPECT_EQ(Get("/metrics", {.authorization = "Bearer " + kToken}).body, "axlecast_up 1\n");
  clock_.Advance(WebAccess::kSession);
  EXPECT_EQ(Get("/", {.cookie = cookie}).status, 401);
}

TEST_F(WebSiteTest, SaysHowItIs) {
  EXPECT_EQ(Get("/healthz").body, "{\"status\":\"ok\"}\n");
  problem_ = "the LCM port failed";
  EXPECT_EQ(Get("/healthz").status, 503);
  EXPECT_THAT(Get("/healthz").body, HasSubstr("the LCM port failed"));
}

TEST_F(WebSiteTest, TakesAsManyBrowsersAsItMay) {
  const WebRequest request = {.path = "/ws", .host = "localhost"};
  for (WebConnection connection = 1; connection <= 2; ++connection) {
    EXPECT_EQ(Upgrade(request), 0);
    site_->OnOpen(connection);
  }
  EXPECT_EQ(Upgrade(request), 503);
  site_->OnClose(1);
  EXPECT_EQ(Upgrade(request), 0);
  EXPECT_EQ(Upgrade({.path = "/socket", .host = "localhost"}), 404);
}

// A page takes 2 s without a frame for a server that is gone.
TEST_F(WebSiteTest, ALogThatStandsStillIsToldOfOnceASecond) {
  RecordedLog log;
  for (std::int64_t i = 0; i < 10; ++i) {
    const std::vector<std::uint8_t> bytes = Encoded(PositionMessage(i));
    log.Add(1'790'000'000'000'000 + i * 1'000'000, "POSITION/axis1", {bytes.begin(), bytes.end()});
  }
  const std::vector<Bytes> logs = {log.bytes()};
  const LogSpan span = SpanOf(logs);
  const WebLogFacts facts = {.files = {"run.lcm"}, .first_utime = span.first, .last_utime = span.last};
  WebSiteParts parts;
  parts.clock = &clock_;
  parts.access = access_.get();
  parts.files = files_;
  parts.tick = [] { return true; };
  parts.open_log = [&] { return std::make_unique<LogPlayer>(logs, machine_, "1", facts, clock_.Now()); };
  site_ = std::make_unique<WebApp>(std::move(parts));
  site_->OnOpen(1);
  int heard = 0;
  for (int tick = 0; tick < 200; ++tick) {  // 10 s
    clock_.Advance(50 * kMillisecond);
    EXPECT_TRUE(site_->OnTick());
    for (std::string type = NextType(1); !type.empty(); type = NextType(1)) heard += type == "playback" ? 1 : 0;
  }
  EXPECT_GE(heard, 9);
  EXPECT_LE(heard, 15);
}

TEST_F(WebSiteTest, AnswersWhatAPageAsksFor) {
  site_->OnOpen(1);
  while (!NextType(1).empty()) {
  }
  site_->OnFrame(1, R"({"type":"seek","utime":1})");
  EXPECT_EQ(NextType(1), "error");  // the machine is live
  site_->OnFrame(1, "nonsense");
  EXPECT_EQ(NextType(1), "error");
  site_->OnFrame(1, R"({"type":"subscribe","devices":["axis1"]})");
  EXPECT_EQ(NextType(1), "");
  model_.OnMessage("POSITION/axis1", Encoded(PositionMessage(0)), {clock_.Now(), clock_.UtcMicroseconds()});
  EXPECT_EQ(NextType(1), "samples");
  EXPECT_EQ(NextType(2), "");  // nobody
}

TEST_F(WebSiteTest, EndsAPageThatAsksTooMuch) {
  site_->OnOpen(1);
  for (int i = 0; i < WebApp::kMaxFrames; ++i) site_->OnFrame(1, "{}");
  EXPECT_EQ(site_->NextFrame(1).close, 0);
  clock_.Advance(kSecond);
  for (int i = 0; i <= WebApp::kMaxFrames; ++i) site_->OnFrame(1, "{}");
  EXPECT_EQ(site_->NextFrame(1).close, 1008);
}

TEST_F(WebSiteTest, ItsPolicyAllowsNothingOfOthers) {
  std::string policy;
  for (const auto& [name, value] : WebApp::SecurityHeaders()) {
    EXPECT_THAT(name, Not(HasSubstr("access-control")));
    if (name == "content-security-policy") policy = value;
  }
  EXPECT_THAT(policy, HasSubstr("default-src 'none'"));
  EXPECT_THAT(policy, Not(HasSubstr("unsafe")));
  EXPECT_THAT(policy, HasSubstr("frame-ancestors 'none'"));
}

TEST_F(WebSiteTest, WithoutAFleetItsQuestionsAreRefused) {
  site_->OnOpen(1);
  while (NextType(1) != "") {
  }
  site_->OnFrame(1, R"({"type":"fleet_machines","id":1})");
  EXPECT_THAT(site_->NextFrame(1).text.value_or(""), HasSubstr("--fleet"));
}

TEST_F(WebSiteTest, AnswersOfTheFleetComeBetweenLiveFramesAndToTheBrowserThatAsked) {
  FleetWorker worker(
      [](const FleetRequest& request) { return R"({"type":"answer","id":)" + std::to_string(request.id) + '}'; },
      [] {});
  Build({}, &worker);
  for (const WebConnection browser : {WebConnection{1}, WebConnection{2}}) {
    site_->OnOpen(browser);
    while (NextType(browser) != "") {
    }
  }
  site_->OnFrame(1, R"({"type":"fleet_machines","id":7})");
  std::string type;
  while ((type = NextType(1)).empty()) std::this_thread::yield();
  EXPECT_EQ(type, "answer");
  EXPECT_EQ(NextType(2), "");
  for (std::size_t i = 0; i <= FleetWorker::kMaxOpen; ++i) site_->OnFrame(1, R"({"type":"fleet_machines","id":8})");
  EXPECT_EQ(NextType(1), "error") << "one question too many: live frames come first";
  site_->OnClose(1);
  EXPECT_EQ(worker.Take(1), std::nullopt);
}

}  // namespace
}  // namespace axlecast
