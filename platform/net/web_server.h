#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace axlecast {

// An HTTP request as it was sent. It is not trusted.
struct WebRequest {
  std::string method = {};  // "GET", "HEAD" or "POST"; others are not answered
  std::string path = {};    // without the query
  std::string query = {};   // what follows the question mark, as it was sent
  std::string host = {};
  std::string origin = {};
  std::string cookie = {};
  std::string authorization = {};
  std::string if_none_match = {};
  std::string subprotocols = {};  // of a WebSocket, as the client lists them
  std::string body = {};
};

struct WebAnswer {
  int status = 200;
  std::string type = "text/plain; charset=utf-8";
  std::string body = {};
  std::vector<std::pair<std::string, std::string>> headers = {};
};

// The next action on a WebSocket: nothing, send a frame, or close with a code.
struct WebFrame {
  std::optional<std::string> text = std::nullopt;
  bool binary = false;  // `text` holds any bytes
  int close = 0;
  std::string reason = {};  // <= 120 bytes
};

using WebConnection = std::uint64_t;  // one WebSocket; never reused

// What a server serves. Called on its thread.
class WebServices {
 public:
  virtual ~WebServices() = default;

  [[nodiscard]] virtual WebAnswer OnRequest(const WebRequest& request) = 0;
  // Returns 0 if a WebSocket may open, or the HTTP status of the refusal.
  [[nodiscard]] virtual int OnUpgrade(const WebRequest& request) = 0;
  virtual void OnOpen(WebConnection connection) = 0;
  virtual void OnFrame(WebConnection connection, std::string_view text) = 0;
  // Called when the connection accepts another frame; not called while it is congested.
  [[nodiscard]] virtual WebFrame NextFrame(WebConnection connection) = 0;
  virtual void OnClose(WebConnection connection) = 0;
  // Called every kTickMs. Returning false ends the server.
  [[nodiscard]] virtual bool OnTick() = 0;
};

struct WebServerSettings {
  std::string address = "127.0.0.1";
  int port = 0;                  // 0: any free one
  std::string certificate = {};  // PEM files; empty: no TLS
  std::string key = {};
  int max_connections = 64;  // of all kinds
  int max_per_address = 32;  // of these, from one address of another host
  // Sent with every answer, also of the library.
  std::vector<std::pair<std::string, std::string>> headers = {};
  // Of WebSockets. A client gets the first one in its own list that is one of these.
  std::vector<std::string> subprotocols = {"axlecast-web-1"};
  std::size_t longest_frame = 16 << 10;  // bytes, of a WebSocket's peer
};

// HTTP and WebSockets: the only place that uses libwebsockets. One thread at a time; one server in a process.
class WebServer {
 public:
  static constexpr int kTickMs = 50;
  static constexpr std::size_t kLongestBody = 4 << 10;  // of a request

  // `services` outlives it.
  WebServer(const WebServerSettings& settings, WebServices& services);
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  // The cause and the remedy if the server does not listen. Empty: it listens.
  [[nodiscard]] const std::string& problem() const { return problem_; }
  [[nodiscard]] int port() const;

  // Serves until OnTick returns false. Returns false if the library failed.
  [[nodiscard]] bool Run();

 private:
  struct State;

  std::unique_ptr<State> state_;
  std::string problem_;
};

}  // namespace axlecast
