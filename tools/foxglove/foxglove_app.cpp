#include "tools/foxglove/foxglove_app.h"

#include <algorithm>
#include <memory>
#include <utility>
#include <variant>

namespace axlecast {
namespace {

constexpr int kPolicyViolation = 1008;  // RFC 6455, 7.4.1
constexpr int kTryAgainLater = 1013;    // IANA's registry of WebSocket close codes

// Alarms, devices and machines: a viewer that has missed one of their messages shows something wrong for long.
bool IsKept(std::string_view channel) { return !channel.starts_with("POSITION") && !channel.starts_with("WIRE"); }

}  // namespace

void FoxgloveApp::OnMessage(const std::string& channel, Bytes message, std::int64_t utime) {
  const FoxgloveFeed::News news = feed_.On(channel, message);
  Announce(news);
  if (news.channel == nullptr) return;
  const std::uint32_t id = news.channel->id;
  if (std::ranges::none_of(viewers_, [id](const auto& each) { return each.second.frames.IsSubscribed(id); }))
    return;
  auto payload = std::make_shared<std::string>();
  if (!news.schema->Transcode(message, *payload)) return;
  const std::int64_t own = news.schema->UtimeOf(message);
  const auto time_ns = static_cast<std::uint64_t>(std::max<std::int64_t>(0, own > 0 ? own : utime)) * 1'000;
  for (auto& [connection, viewer] : viewers_) viewer.frames.Add(id, time_ns, payload, IsKept(channel));
}

void FoxgloveApp::Announce(const FoxgloveFeed::News& news) {
  for (auto& [connection, viewer] : viewers_) {
    if (news.unadvertise != 0) {
      viewer.frames.Forget(news.unadvertise);
      viewer.frames.Add(FoxgloveUnadvertise({news.unadvertise}));
    }
    if (news.advertise) viewer.frames.Add(FoxgloveAdvertise({news.channel}));
    if (!news.problem.empty())
      viewer.frames.Add(FoxgloveStatus(FoxgloveLevel::kWarning, news.problem, news.problem));
  }
}

std::int64_t FoxgloveApp::dropped() const {
  std::int64_t count = dropped_before_;
  for (const auto& [connection, viewer] : viewers_) count += viewer.frames.dropped();
  return count;
}

WebAnswer FoxgloveApp::OnRequest(const WebRequest& request) {
  if (!parts_.access->IsHost(request.host))
    return {.status = 421, .body = "this host has another name: give it with --name\n"};
  if (request.method != "GET" && request.method != "HEAD") return {.status = 405, .body = "GET only\n"};
  if (request.path == "/healthz") {
    const std::string problem = parts_.problem();
    return {.status = problem.empty() ? 200 : 503, .body = (problem.empty() ? "ok" : problem) + "\n"};
  }
  if (request.path != "/") return {.status = 404, .body = "there is no such page\n"};
  return {.body = "The messages of " + parts_.name +
                  " for Foxglove, Lichtblick and PlotJuggler: open a connection to ws://" + request.host +
                  " there (wss:// with TLS).\n"};
}

bool FoxgloveApp::IsAllowedOrigin(const WebRequest& request) const {
  return parts_.access->IsOwnOrigin(request) ||
         std::ranges::find(parts_.origins, request.origin) != parts_.origins.end();
}

int FoxgloveApp::OnUpgrade(const WebRequest& request) {
  if (!parts_.access->IsHost(request.host) || !IsAllowedOrigin(request)) return 403;
  if (request.path != "/") return 404;
  const std::vector<std::string> known = Subprotocols();
  if (std::ranges::none_of(
          known, [&](const std::string& each) { return request.subprotocols.find(each) != std::string::npos; }))
    return 400;
  if (!parts_.access->MayLook(request, parts_.clock->Now()) &&
      !parts_.access->IsToken(FormValue(request.query, "token")))
    return 401;
  return viewers_.size() < parts_.max_viewers ? 0 : 503;
}

void FoxgloveApp::OnOpen(WebConnection connection) {
  FoxgloveViewer& frames = viewers_[connection].frames;
  frames.Add(FoxgloveServerInfo(parts_.name, parts_.session_id));
  if (const auto channels = feed_.Channels(); !channels.empty()) frames.Add(FoxgloveAdvertise(channels));
  for (const std::string& problem : feed_.problems())
    frames.Add(FoxgloveStatus(FoxgloveLevel::kWarning, problem, problem));
}

void FoxgloveApp::OnFrame(WebConnection connection, std::string_view text) {
  const auto found = viewers_.find(connection);
  if (found == viewers_.end()) return;
  Viewer& viewer = found->second;
  const MonoNs now = parts_.clock->Now();
  if (now - viewer.window >= kSecond) {
    viewer.window = now;
    viewer.requests = 0;
  }
  viewer.too_many = viewer.too_many || ++viewer.requests > kMaxRequests;
  if (viewer.too_many) return;
  if (const auto request = ParseFoxgloveRequest(text)) {
    Execute(viewer, *request);
  } else {
    viewer.frames.Add(
        FoxgloveStatus(FoxgloveLevel::kError, "a request is not one of the Foxglove protocol", "request"));
  }
}

void FoxgloveApp::Execute(Viewer& viewer, const FoxgloveRequest& request) const {
  const auto report = [&viewer](const std::string& problem) {
    if (!problem.empty()) viewer.frames.Add(FoxgloveStatus(FoxgloveLevel::kWarning, problem, "request"));
  };
  if (const auto* const subscribe = std::get_if<FoxgloveSubscribe>(&request)) {
    for (const auto& one : subscribe->subscriptions)
      report(ErrorText(viewer.frames.Subscribe(one, feed_.Knows(one.channel))));
  } else if (const auto* const unsubscribe = std::get_if<FoxgloveUnsubscribe>(&request)) {
    for (const std::uint32_t one : unsubscribe->subscriptions) report(ErrorText(viewer.frames.Unsubscribe(one)));
  } else if (const auto* const other = std::get_if<FoxgloveUnsupported>(&request)) {
    report("this server only shows messages: it does not support " + other->operation);
  }
}

WebFrame FoxgloveApp::NextFrame(WebConnection connection) {
  const auto found = viewers_.find(connection);
  if (found == viewers_.end()) return {};
  Viewer& viewer = found->second;
  if (viewer.too_many) return {.close = kPolicyViolation, .reason = "more than 10000 requests in a second"};
  if (viewer.frames.is_stuck()) return {.close = kTryAgainLater, .reason = "this viewer reads nothing"};
  std::optional<FoxgloveFrame> frame = viewer.frames.Next(parts_.clock->Now());
  if (!frame) return {};
  return {.text = std::move(frame->text), .binary = frame->binary};
}

void FoxgloveApp::OnClose(WebConnection connection) {
  const auto found = viewers_.find(connection);
  if (found == viewers_.end()) return;
  dropped_before_ += found->second.frames.dropped();
  viewers_.erase(found);
}

bool FoxgloveApp::OnTick() { return parts_.tick(); }

}  // namespace axlecast
