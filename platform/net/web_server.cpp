#include "platform/net/web_server.h"

#include <arpa/inet.h>
#include <libwebsockets.h>
#include <netdb.h>
#include <strings.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <map>

#include "platform/net/web_connections.h"
#include "platform/os/descriptor.h"

namespace axlecast {
namespace {

// What waits in the kernel for a slow reader is old when it arrives. This is sufficient for a fast reader.
constexpr int kSendBuffer = 128 << 10;
constexpr std::size_t kChunk = 16 << 10;
constexpr std::size_t kReceiveBuffer = 16 << 10;
// A peer that does not answer for this time is gone, such as a tablet out of range.
constexpr std::uint16_t kPingSeconds = 15;
constexpr std::uint16_t kGoneSeconds = 60;
constexpr unsigned kRequestSeconds = 10;
constexpr int kIdleSeconds = 15;
constexpr int kSpareDescriptors = 16;  // the listener's, and those of connections that are about to close

std::string& LibraryErrors() {
  static std::string errors;
  return errors;
}

void KeepError(int /*level*/, const char* line) {
  std::string& errors = LibraryErrors();
  if (errors.size() < 1000) errors += line;
}

std::string Header(lws* wsi, lws_token_indexes token) {
  const int length = lws_hdr_total_length(wsi, token);
  if (length <= 0) return "";
  std::string text(static_cast<std::size_t>(length) + 1, '\0');
  const int copied = lws_hdr_copy(wsi, text.data(), static_cast<int>(text.size()), token);
  text.resize(copied > 0 ? static_cast<std::size_t>(copied) : 0);
  return text;
}

WebRequest ReadRequest(lws* wsi) {
  WebRequest request;
  for (const auto& [token, method] :
       {std::pair{WSI_TOKEN_GET_URI, "GET"}, {WSI_TOKEN_POST_URI, "POST"}, {WSI_TOKEN_HEAD_URI, "HEAD"}}) {
    if (lws_hdr_total_length(wsi, token) <= 0) continue;
    request.method = method;
    request.path = Header(wsi, token);
  }
  request.host = Header(wsi, WSI_TOKEN_HOST);
  request.origin = Header(wsi, WSI_TOKEN_ORIGIN);
  request.cookie = Header(wsi, WSI_TOKEN_HTTP_COOKIE);
  request.authorization = Header(wsi, WSI_TOKEN_HTTP_AUTHORIZATION);
  request.if_none_match = Header(wsi, WSI_TOKEN_HTTP_IF_NONE_MATCH);
  request.query = Header(wsi, WSI_TOKEN_HTTP_URI_ARGS);
  request.subprotocols = Header(wsi, WSI_TOKEN_PROTOCOL);
  return request;
}

MonoNs Now() { return lws_now_usecs() * kMicrosecond; }

// Returns the address of the peer, as WebConnections counts it.
std::string AddressOf(lws_sockfd_type socket) {
  std::array<char, 64> text{};
  sockaddr_storage peer{};
  socklen_t size = sizeof peer;
  if (getpeername(socket, reinterpret_cast<sockaddr*>(&peer), &size) != 0) return "?";
  const void* address = peer.ss_family == AF_INET6
                            ? static_cast<const void*>(&reinterpret_cast<const sockaddr_in6*>(&peer)->sin6_addr)
                            : &reinterpret_cast<const sockaddr_in*>(&peer)->sin_addr;
  if (inet_ntop(peer.ss_family, address, text.data(), text.size()) == nullptr) return "?";
  return WebAddressKey(text.data());
}

// Closes a connection in the next loop of the library.
void CloseSoon(lws* wsi) { lws_set_timeout(wsi, PENDING_TIMEOUT_USER_REASON_BASE, LWS_TO_KILL_ASYNC); }

// Bytes with the space before them that the library requires.
class OutBuffer {
 public:
  explicit OutBuffer(std::size_t room) : bytes_(LWS_PRE + room) {}
  explicit OutBuffer(std::string_view text) : bytes_(LWS_PRE + text.size()) {
    std::copy(text.begin(), text.end(), begin());
  }
  [[nodiscard]] unsigned char* begin() { return bytes_.data() + LWS_PRE; }
  [[nodiscard]] unsigned char* end() { return bytes_.data() + bytes_.size(); }

 private:
  std::vector<unsigned char> bytes_;
};

// One connection's state.
struct Peer {
  WebConnection connection = 0;  // not 0: an open WebSocket
  WebRequest request;
  std::string text;  // of a frame, or the rest of an answer
  std::size_t sent = 0;
};

}  // namespace

struct WebServer::State {
  State(WebServerSettings the_settings, WebServices& the_services);
  ~State() {
    if (context != nullptr) lws_context_destroy(context);
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  static int OnEvent(lws* wsi, lws_callback_reasons reason, void* user, void* in, std::size_t size);
  static void OnTimer(lws_sorted_usec_list_t* timer);

  int OnNewcomer(lws_sockfd_type socket);
  int OnHttp(lws* wsi, Peer& peer);
  int OnBody(lws* wsi, Peer& peer, std::string_view part);
  int OnUpgrade(lws* wsi);
  int OnReceive(lws* wsi, Peer& peer, std::string_view part);
  int OnWritable(lws* wsi, Peer& peer);
  int Answer(lws* wsi, Peer& peer);
  int SendBody(lws* wsi, Peer& peer);
  int Completed(lws* wsi);
  void Forget(lws* wsi);
  void Listen();

  // The first member: OnTimer finds the state by it.
  struct Timer {
    lws_sorted_usec_list_t list{};
    State* state = nullptr;
  } timer;
  WebServerSettings settings;  // the library keeps pointers into it
  WebServices& services;
  lws_context* context = nullptr;
  lws_vhost* vhost = nullptr;
  std::map<lws*, Peer> peers;
  WebConnections connections;
  WebConnection last_connection = 0;
  bool ended = false;
  std::vector<lws_protocol_vhost_options> headers;
  std::vector<lws_protocols> protocols;  // ends with an empty one
  lws_retry_bo_t liveness{};
};

WebServer::State::State(WebServerSettings the_settings, WebServices& the_services)
    : settings(std::move(the_settings)),
      services(the_services),
      connections({.total = static_cast<std::size_t>(settings.max_connections),
                   .per_address = static_cast<std::size_t>(settings.max_per_address)}) {
  for (auto& [name, value] : settings.headers) name += ':';  // as the library requires
  timer.state = this;
  for (const std::string& name : settings.subprotocols) {
    lws_protocols& protocol = protocols.emplace_back();
    protocol.name = name.c_str();
    protocol.callback = &State::OnEvent;
    protocol.rx_buffer_size = kReceiveBuffer;
  }
  protocols.emplace_back();
  liveness.secs_since_valid_ping = kPingSeconds;
  liveness.secs_since_valid_hangup = kGoneSeconds;
  Listen();
  if (context != nullptr) lws_sul_schedule(context, 0, &timer.list, &State::OnTimer, 1);
}

void WebServer::State::Listen() {
  LibraryErrors().clear();
  lws_set_log_level(LLL_ERR, &KeepError);
  headers.resize(settings.headers.size());
  for (std::size_t i = 0; i < headers.size(); ++i) {
    const auto& [name, value] = settings.headers[i];
    headers[i] = {i + 1 < headers.size() ? &headers[i + 1] : nullptr, nullptr, name.c_str(), value.c_str()};
  }
  lws_context_creation_info info{};
  info.iface = settings.address.c_str();
  info.port = settings.port;
  info.protocols = protocols.data();
  info.user = this;
  info.headers = headers.empty() ? nullptr : headers.data();
  info.server_string = "axlecast";
  info.options = LWS_SERVER_OPTION_VALIDATE_UTF8 | LWS_SERVER_OPTION_FAIL_UPON_UNABLE_TO_BIND |
                 LWS_SERVER_OPTION_EXPLICIT_VHOSTS;
  info.timeout_secs = kRequestSeconds;
  info.keepalive_timeout = kIdleSeconds;
  info.fd_limit_per_thread = static_cast<unsigned>(settings.max_connections + kSpareDescriptors);
  info.retry_and_idle_policy = &liveness;
  info.alpn = "http/1.1";
  if (!settings.certificate.empty()) {
    info.options |= LWS_SERVER_OPTION_DO_SSL_GLOBAL_INIT;
    info.ssl_cert_filepath = settings.certificate.c_str();
    info.ssl_private_key_filepath = settings.key.c_str();
  }
  context = lws_create_context(&info);
  if (context != nullptr) vhost = lws_create_vhost(context, &info);
}

void WebServer::State::OnTimer(lws_sorted_usec_list_t* list) {
  State& state = *lws_container_of(list, Timer, list)->state;
  state.ended = !state.services.OnTick();
  for (const auto& [wsi, peer] : state.peers) {
    if (peer.connection != 0) lws_callback_on_writable(wsi);
  }
  for (const void* slow : state.connections.ToClose(Now())) CloseSoon(static_cast<lws*>(const_cast<void*>(slow)));
  if (state.ended) return lws_cancel_service(state.context);
  lws_sul_schedule(state.context, 0, list, &State::OnTimer, kTickMs * LWS_US_PER_MS);
}

int WebServer::State::OnEvent(lws* wsi, lws_callback_reasons reason, void* /*user*/, void* in, std::size_t size) {
  if (wsi == nullptr) return 0;
  State& state = *static_cast<State*>(lws_context_user(lws_get_context(wsi)));
  const std::string_view part(in == nullptr ? "" : static_cast<const char*>(in), in == nullptr ? 0 : size);
  switch (reason) {
    case LWS_CALLBACK_FILTER_NETWORK_CONNECTION:
      return state.OnNewcomer(static_cast<lws_sockfd_type>(reinterpret_cast<std::intptr_t>(in)));
    case LWS_CALLBACK_SERVER_NEW_CLIENT_INSTANTIATED:
      state.connections.Add(wsi, AddressOf(lws_get_socket_fd(wsi)), Now());
      return 0;
    case LWS_CALLBACK_RAW_ADOPT:  // a CONNECT request
    case LWS_CALLBACK_RAW_RX:
      return -1;
    case LWS_CALLBACK_HTTP:
      return state.OnHttp(wsi, state.peers[wsi]);
    case LWS_CALLBACK_HTTP_BODY:
      return state.OnBody(wsi, state.peers[wsi], part);
    case LWS_CALLBACK_HTTP_BODY_COMPLETION:
      return state.Answer(wsi, state.peers[wsi]);
    case LWS_CALLBACK_HTTP_WRITEABLE:
      return state.SendBody(wsi, state.peers[wsi]);
    case LWS_CALLBACK_HTTP_CONFIRM_UPGRADE:
      return state.OnUpgrade(wsi);
    case LWS_CALLBACK_ESTABLISHED: {
      Peer& peer = state.peers[wsi] = {};
      peer.connection = ++state.last_connection;
      state.connections.OnWebSocket(wsi, Now());
      static_cast<void>(
          setsockopt(lws_get_socket_fd(wsi), SOL_SOCKET, SO_SNDBUF, &kSendBuffer, sizeof kSendBuffer));
      state.services.OnOpen(peer.connection);
      lws_callback_on_writable(wsi);
      return 0;
    }
    case LWS_CALLBACK_RECEIVE:
      return state.OnReceive(wsi, state.peers[wsi], part);
    case LWS_CALLBACK_SERVER_WRITEABLE:
      return state.OnWritable(wsi, state.peers[wsi]);
    case LWS_CALLBACK_CLOSED:
    case LWS_CALLBACK_CLOSED_HTTP:
    case LWS_CALLBACK_WSI_DESTROY:
      state.Forget(wsi);
      return 0;
    default:
      return 0;
  }
}

int WebServer::State::OnNewcomer(lws_sockfd_type socket) {
  const WebConnections::Admission admission = connections.Admit(AddressOf(socket), Now());
  if (admission.close != nullptr) CloseSoon(static_cast<lws*>(const_cast<void*>(admission.close)));
  return admission.admitted ? 0 : 1;
}

int WebServer::State::OnHttp(lws* wsi, Peer& peer) {
  peer = {};
  peer.request = ReadRequest(wsi);
  if (peer.request.method != "POST") return Answer(wsi, peer);
  const std::string length = Header(wsi, WSI_TOKEN_HTTP_CONTENT_LENGTH);
  if (length.empty()) return lws_return_http_status(wsi, HTTP_STATUS_LENGTH_REQUIRED, nullptr) != 0 ? -1 : 1;
  return 0;  // its body comes
}

int WebServer::State::OnBody(lws* wsi, Peer& peer, std::string_view part) {
  if (peer.request.body.size() + part.size() > kLongestBody) {
    static_cast<void>(lws_return_http_status(wsi, HTTP_STATUS_REQ_ENTITY_TOO_LARGE, nullptr));
    return -1;
  }
  peer.request.body += part;
  return 0;
}

int WebServer::State::Completed(lws* wsi) {
  connections.OnAnswered(wsi, Now());
  return lws_http_transaction_completed(wsi) != 0 ? -1 : 0;
}

int WebServer::State::Answer(lws* wsi, Peer& peer) {
  connections.OnWholeRequest(wsi, Now());
  WebAnswer answer = services.OnRequest(peer.request);
  OutBuffer buffer(4096 + kChunk);
  unsigned char* at = buffer.begin();
  if (lws_add_http_common_headers(wsi, static_cast<unsigned>(answer.status), answer.type.c_str(),
                                  answer.body.size(), &at, buffer.end()) != 0) {
    return -1;
  }
  for (const auto& [name, value] : answer.headers) {
    const std::string label = name + ':';
    if (lws_add_http_header_by_name(wsi, reinterpret_cast<const unsigned char*>(label.c_str()),
                                    reinterpret_cast<const unsigned char*>(value.data()),
                                    static_cast<int>(value.size()), &at, buffer.end()) != 0) {
      return -1;
    }
  }
  if (lws_finalize_write_http_header(wsi, buffer.begin(), &at, buffer.end()) != 0) return -1;
  peer.text = std::move(answer.body);
  peer.sent = 0;
  if (peer.request.method == "HEAD" || peer.text.empty()) return Completed(wsi);
  lws_callback_on_writable(wsi);
  return 0;
}

int WebServer::State::SendBody(lws* wsi, Peer& peer) {
  if (peer.sent >= peer.text.size()) return 0;
  const std::string_view chunk = std::string_view(peer.text).substr(peer.sent, kChunk);
  peer.sent += chunk.size();
  const bool last = peer.sent == peer.text.size();
  OutBuffer buffer(chunk);
  if (lws_write(wsi, buffer.begin(), chunk.size(), last ? LWS_WRITE_HTTP_FINAL : LWS_WRITE_HTTP) < 0) return -1;
  if (last) return Completed(wsi);
  lws_callback_on_writable(wsi);
  return 0;
}

// The library supports HTTP/2 without TLS (h2c), which ends in an assertion if the following bytes are malformed.
int WebServer::State::OnUpgrade(lws* wsi) {
  const std::string protocol = Header(wsi, WSI_TOKEN_UPGRADE);
  if (strcasecmp(protocol.c_str(), "websocket") != 0) {
    // The library has already refused other protocols than h2c.
    if (strcasecmp(protocol.c_str(), "h2c") == 0)
      static_cast<void>(lws_return_http_status(wsi, HTTP_STATUS_FORBIDDEN, nullptr));
    return -1;
  }
  const int refused = services.OnUpgrade(ReadRequest(wsi));
  if (refused == 0) return 0;
  return lws_return_http_status(wsi, static_cast<unsigned>(refused), nullptr) != 0 ? -1 : 1;
}

int WebServer::State::OnReceive(lws* wsi, Peer& peer, std::string_view part) {
  const auto close = [wsi](lws_close_status code) {
    lws_close_reason(wsi, code, nullptr, 0);
    return -1;
  };
  if (lws_frame_is_binary(wsi) != 0) return close(LWS_CLOSE_STATUS_UNACCEPTABLE_OPCODE);
  if (peer.text.size() + part.size() > settings.longest_frame) return close(LWS_CLOSE_STATUS_MESSAGE_TOO_LARGE);
  peer.text += part;
  if (lws_is_final_fragment(wsi) == 0 || lws_remaining_packet_payload(wsi) > 0) return 0;
  services.OnFrame(peer.connection, peer.text);
  peer.text.clear();
  lws_callback_on_writable(wsi);
  return 0;
}

int WebServer::State::OnWritable(lws* wsi, Peer& peer) {
  const WebFrame frame = services.NextFrame(peer.connection);
  if (frame.close != 0) {
    OutBuffer reason(frame.reason);
    lws_close_reason(wsi, static_cast<lws_close_status>(frame.close), reason.begin(), frame.reason.size());
    return -1;
  }
  if (!frame.text) return 0;
  OutBuffer buffer(*frame.text);
  if (lws_write(wsi, buffer.begin(), frame.text->size(), frame.binary ? LWS_WRITE_BINARY : LWS_WRITE_TEXT) < 0)
    return -1;
  lws_callback_on_writable(wsi);
  return 0;
}

void WebServer::State::Forget(lws* wsi) {
  connections.Remove(wsi);
  const auto found = peers.find(wsi);
  if (found == peers.end()) return;
  const WebConnection connection = found->second.connection;
  peers.erase(found);
  if (connection != 0) services.OnClose(connection);
}

namespace {

// Returns why the address cannot be bound, with the remedy, because the library only logs a number. No text: it can be bound.
std::string BindFailureText(const WebServerSettings& settings) {
  addrinfo hints{};
  hints.ai_flags = AI_NUMERICHOST | AI_NUMERICSERV | AI_PASSIVE;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  const std::string port = std::to_string(settings.port);
  if (getaddrinfo(settings.address.c_str(), port.c_str(), &hints, &found) != 0) return "";
  const Descriptor probe(socket(found->ai_family, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const int on = 1;  // as in the library: a port of a server that has just ended is free
  static_cast<void>(setsockopt(probe.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on));
  const bool bound = bind(probe.get(), found->ai_addr, found->ai_addrlen) == 0 && listen(probe.get(), 1) == 0;
  const int error = bound ? 0 : errno;
  freeaddrinfo(found);
  switch (error) {
    case 0:
      return "";
    case EADDRINUSE:
      return "another program listens there (ss -ltnp 'sport = :" + port +
             "' names it); end it, or take another port";
    case EACCES:
      return "ports below 1024 are root's; take another port";
    case EADDRNOTAVAIL:
      return "this host has no such address (ip address shows those that it has)";
    default:
      return std::strerror(error);
  }
}

}  // namespace

WebServer::WebServer(const WebServerSettings& settings, WebServices& services) {
  // Before the library: it would wait without a word for an address that the host does not have.
  std::string why = BindFailureText(settings);
  if (why.empty()) {
    state_ = std::make_unique<State>(settings, services);
    if (state_->vhost != nullptr) return;
    why = LibraryErrors().empty() ? "the library gives no reason" : LibraryErrors();
  }
  problem_ = "cannot serve on " + settings.address + " port " + std::to_string(settings.port) + ": " + why;
  while (problem_.ends_with('\n')) problem_.pop_back();
}

WebServer::~WebServer() = default;

int WebServer::port() const { return lws_get_vhost_listen_port(state_->vhost); }

bool WebServer::Run() {
  while (!state_->ended) {
    if (lws_service(state_->context, 0) < 0) return state_->ended;
  }
  return true;
}

}  // namespace axlecast
