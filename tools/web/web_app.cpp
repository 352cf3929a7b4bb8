#include "tools/web/web_app.h"

#include <algorithm>
#include <utility>
#include <variant>

#include "tools/web/web_answers.h"

namespace axlecast {
namespace {

constexpr int kPolicyViolation = 1008;  // RFC 6455, 7.4.1
constexpr int kTryAgainLater = 1013;    // IANA's registry of WebSocket close codes
constexpr MonoNs kPlaybackPeriod = 250 * kMillisecond;
// A paused position is repeated, so that a browser can distinguish a paused log from a lost server.
constexpr MonoNs kPlaybackRepeat = kSecond;

}  // namespace

std::vector<std::pair<std::string, std::string>> WebApp::SecurityHeaders() {
  return {{"content-security-policy",
           "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
           "font-src 'self'; form-action 'self'; base-uri 'none'; frame-ancestors 'none'"},
          {"x-content-type-options", "nosniff"},
          {"x-frame-options", "deny"},
          {"referrer-policy", "no-referrer"},
          {"cross-origin-opener-policy", "same-origin"},
          {"cross-origin-resource-policy", "same-origin"}};
}

WebAnswer WebApp::OnRequest(const WebRequest& request) {
  if (!parts_.access->IsHost(request.host)) return ForeignHostAnswer();
  if (request.method == "POST" && request.path == "/login") return SignIn(request);
  if (request.method == "GET" || request.method == "HEAD") return Get(request);
  return MethodAnswer();
}

WebAnswer WebApp::Get(const WebRequest& request) const {
  if (request.path == "/healthz") return HealthAnswer(parts_.problem());
  if (request.path == "/metrics") return Metrics(request);
  if (request.path == "/login") return File("login.html", request);
  const bool page = request.path == "/" || request.path == "/index.html";
  if (!page) return File(std::string_view(request.path).substr(1), request);
  return parts_.access->MayLook(request, parts_.clock->Now()) ? File("index.html", request) : SignInPage();
}

WebAnswer WebApp::SignIn(const WebRequest& request) {
  if (!parts_.access->IsOwnOrigin(request)) return PlainAnswer(403, "a form of another origin");
  if (!parts_.access->IsToken(FormValue(request.body, "token"))) return SignInPage();
  return {.status = 303,
          .headers = {{"location", "/"},
                      {"set-cookie", parts_.access->Open(parts_.clock->Now())},
                      {"cache-control", "no-store"}}};
}

const PageFile* WebApp::Find(std::string_view name) const {
  const auto found = std::find_if(parts_.files.begin(), parts_.files.end(),
                                  [name](const PageFile& file) { return file.name == name; });
  return found == parts_.files.end() ? nullptr : &*found;
}

WebAnswer WebApp::File(std::string_view name, const WebRequest& request) const {
  const PageFile* file = Find(name);
  if (file == nullptr) return PlainAnswer(404, "there is no such page");
  WebAnswer answer = {.type = std::string(file->type),
                      .headers = {{"etag", std::string(file->etag)}, {"cache-control", "no-cache"}}};
  if (request.if_none_match.find(file->etag) != std::string::npos) {
    answer.status = 304;
  } else {
    answer.body = file->content;
  }
  return answer;
}

WebAnswer WebApp::SignInPage() const {
  const PageFile* file = Find("login.html");
  return {.status = 401,
          .type = std::string(file->type),
          .body = std::string(file->content),
          .headers = {{"cache-control", "no-store"}, {"www-authenticate", "Bearer realm=\"axlecast\""}}};
}

WebAnswer WebApp::Metrics(const WebRequest& request) const {
  if (!parts_.metrics) return PlainAnswer(404, "only a live machine has metrics");
  if (!parts_.access->MayLook(request, parts_.clock->Now())) {
    WebAnswer answer = PlainAnswer(401, "needs the token: Authorization: Bearer ...");
    answer.headers.emplace_back("www-authenticate", "Bearer realm=\"axlecast\"");
    return answer;
  }
  return MetricsAnswer(parts_.metrics());
}

int WebApp::OnUpgrade(const WebRequest& request) {
  if (!parts_.access->IsHost(request.host) || !parts_.access->IsOwnOrigin(request)) return 403;
  if (request.path != "/ws") return 404;
  if (!parts_.access->MayLook(request, parts_.clock->Now())) return 401;
  return clients_.size() < parts_.max_clients ? 0 : 503;
}

void WebApp::OnOpen(WebConnection connection) {
  Client& client = clients_[connection];
  if (parts_.open_log) client.player = parts_.open_log();
  client.feed.Start(ModelOf(client), NowOf(client));
}

WebTimestamp WebApp::NowOf(const Client& client) const {
  const MonoNs now = parts_.clock->Now();
  return client.player ? client.player->Now(now) : WebTimestamp{now, parts_.clock->UtcMicroseconds()};
}

bool WebApp::TakesFrame(Client& client) const {
  const MonoNs now = parts_.clock->Now();
  if (now - client.window >= kSecond) {
    client.window = now;
    client.frames = 0;
  }
  return ++client.frames <= kMaxFrames;
}

void WebApp::OnFrame(WebConnection connection, std::string_view text) {
  const auto found = clients_.find(connection);
  if (found == clients_.end()) return;
  Client& client = found->second;
  client.too_many = client.too_many || !TakesFrame(client);
  if (client.too_many) return;
  const Result<PageRequest> request = ParsePageRequest(text);
  Result<> done;
  if (!request) {
    done = Failure(request.error());
  } else if (const auto* question = std::get_if<FleetRequest>(&*request)) {
    done = AskFleet(connection, *question);
  } else {
    done = Execute(client, *request);
  }
  if (!done) client.feed.Queue(ErrorFrame(done.error().text));
}

Result<> WebApp::AskFleet(WebConnection connection, const FleetRequest& request) const {
  if (parts_.fleet == nullptr) return Failure("this server has no fleet database: start it with --fleet");
  if (parts_.fleet->Ask(connection, request)) return {};
  return Failure("more than " + std::to_string(FleetWorker::kMaxOpen) + " open questions to the fleet database");
}

Result<> WebApp::Execute(Client& client, const PageRequest& request) const {
  if (const auto* subscribe = std::get_if<SubscribeRequest>(&request)) {
    return client.feed.Subscribe(ModelOf(client), *subscribe, NowOf(client));
  }
  if (!client.player) return Failure("the machine is live: only a log can be played");
  const MonoNs now = parts_.clock->Now();
  if (const auto* seek = std::get_if<SeekRequest>(&request)) client.player->Seek(seek->utime, now);
  if (const auto* play = std::get_if<PlayRequest>(&request)) client.player->Play(play->play, now);
  if (const auto* speed = std::get_if<SpeedRequest>(&request)) client.player->SetSpeed(speed->factor, now);
  return {};
}

bool WebApp::PlaybackIsDue(Client& client) const {
  const MonoNs now = parts_.clock->Now();
  const WebPlayback playback = client.player->Playback(now);
  WebPlayback before = client.playback;
  before.utime = playback.utime;
  const MonoNs age = now - client.playback_sent;
  const bool due = age >= kPlaybackRepeat || (client.playback != playback && age >= kPlaybackPeriod);
  if (playback == before && !due) return false;
  client.playback = playback;
  client.playback_sent = now;
  return true;
}

void WebApp::OnClose(WebConnection connection) {
  clients_.erase(connection);
  if (parts_.fleet != nullptr) parts_.fleet->Forget(connection);
}

std::optional<std::string> WebApp::TakeAnswer(WebConnection connection) const {
  return parts_.fleet != nullptr ? parts_.fleet->Take(connection) : std::nullopt;
}

WebFrame WebApp::NextFrame(WebConnection connection) {
  const auto found = clients_.find(connection);
  if (found == clients_.end()) return {};
  Client& client = found->second;
  if (client.too_many) return {.close = kPolicyViolation, .reason = "too many frames"};
  if (client.player) {
    if (auto frame = client.feed.NextQueued()) return {.text = std::move(frame)};
    if (PlaybackIsDue(client)) return {.text = PlaybackFrame(client.playback)};
    if (client.playback.seeking) return {};
  }
  WebModel& model = ModelOf(client);
  if (client.feed.fell_behind(model)) return {.close = kTryAgainLater, .reason = "fell behind"};
  // At most one answer between two frames of live data, so that neither waits for the other.
  if (std::exchange(client.answer_is_next, false)) {
    if (auto answer = TakeAnswer(connection)) return {.text = std::move(answer)};
  }
  if (auto frame = client.feed.Next(model, NowOf(client))) {
    client.answer_is_next = true;
    return {.text = std::move(frame)};
  }
  return {.text = TakeAnswer(connection)};
}

bool WebApp::OnTick() {
  if (!parts_.tick()) return false;
  for (auto& [connection, client] : clients_) {
    if (client.player && client.player->Advance(parts_.clock->Now())) {
      client.feed.Start(client.player->model(), NowOf(client), true);
    }
  }
  return true;
}

}  // namespace axlecast
